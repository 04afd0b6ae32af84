// Where tags, holes and strips go on a panel. Drawn from the seed; nothing in it is symmetric.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/sim/random.h"
#include "drivers/sim/sheet.h"
#include "drivers/sim/tag_picture.h"

namespace veneer::sim {

inline constexpr double kBoardMargin = 24;  // mm of primed board around the veneer

// A strip between two nearly straight edges: x of each edge at the lower and upper end of the field.
struct StripPlace {
  std::string species;
  double left_low = 0, left_high = 0, right_low = 0, right_high = 0;  // mm
};

struct PanelLayout {
  std::vector<TagPlace> tags;  // ids not yet given (0)
  std::vector<TrueHole> holes;
  std::vector<TrueHole> screw_holes;
  std::vector<StripPlace> strips;
};

PanelLayout draw_layout(double width_mm, double height_mm, int strips, std::uint64_t seed);

}  // namespace veneer::sim
