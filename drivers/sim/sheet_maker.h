// Makes sheets: veneer panels, the AprilGrid sheet, plain boards.
//
// Pure functions of their arguments; take seconds for a large panel; use all cores.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/result.h"
#include "drivers/sim/roughness.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

struct PanelOrder {
  std::string name;
  double width_mm = 0, height_mm = 0;
  int strips = 0;     // 0 = as many as look right
  int first_tag = 0;  // ids first_tag, first_tag + 1, ... are printed on it
  double dpi = 400;
  std::uint64_t seed = 0;
  Roughness rough = {};
};

// kInvalidArgument for sizes that no panel can have, kConflict when the tag family is used up.
Result<std::shared_ptr<Sheet>> make_panel(const PanelOrder& order);
// 12 x 10 tags, ids 0 to 119 row by row from the lower left, black square 18 mm, pitch 24 mm, thickness 0: a film on a
// flat plate, so the height it is laid at is the height of its printed face. Its printer is off by
// up to `print_error` either way, each way for itself.
std::shared_ptr<Sheet> make_grid(const std::string& name, double dpi, std::uint64_t seed, double print_error = 0);
Result<std::shared_ptr<Sheet>> make_board(const PanelOrder& order);

}  // namespace veneer::sim
