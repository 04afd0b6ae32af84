// What `veneerctl laser test-pattern` burns: enough to see with calipers and a loupe whether a laser is set up right,
// with nothing else of the cell there.
//
// In a square of the given size: its outline, its diagonals and the largest circle that leaves a tenth free (axes at
// right angles, equal scale, no backlash), ticks every 5 mm along its left and lower edge (scale), all engraved; and a
// square of a fifth of the size, at most 10 mm, cut through in the middle: its hole is larger, and what falls out
// smaller, than drawn by the kerf. Pure; thread-safe.
#pragma once

#include <optional>

#include "base/geometry.h"
#include "base/result.h"
#include "daemon/config.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

struct TestPatternOptions {
  Millimetres size{50};
  // Its lower left; without it the middle of the bed, or of a machine without homing switches the corner it was given.
  std::optional<Point<MachineFrame>> corner = std::nullopt;
  bool dark = false;  // all motions, no beam
};

// kInvalidArgument when it does not fit into the travel, with what would.
Result<LaserJob> make_test_pattern(const LaserLimits& limits, const RecipeConfig& recipe,
                                   const TestPatternOptions& options);

}  // namespace veneer::daemon
