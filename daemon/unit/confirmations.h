// What an operator confirms by name before the beam comes on. Pure.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

// Confirmed of the board that is measured by, before the laser's pattern is burnt into it: that it lies in the middle
// of the bed, and that the camera does not tell it from the bed (daemon/calibration/pattern_board.h).
inline constexpr const char* kBoardOnTheBed = "board on the bed";
inline constexpr const char* kBoardNotSeen = "board not seen";

// kRefused, naming what is missing, unless everything of `wanted` is among what was confirmed.
Status check_confirmed(const std::vector<std::string>& wanted, const std::vector<std::string>& confirmed);

}  // namespace veneer::daemon
