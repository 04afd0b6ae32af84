// Which edges of a picture a morphed grid follows, as somebody painted it over the picture with a finger: coarse, and
// so short that it is one of a plan's parameters. Pure.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

inline constexpr std::string_view kAllEdges = "all";
inline constexpr int kMostEdgeCells = 64;  // a side

// "all", and then the mask is empty; or WIDTHxHEIGHT:HEX, cells over the whole picture, row by row from its upper left
// corner, four in a digit, the first in its highest bit: set where edges count. 255 there, else 0.
// kInvalidArgument: `name` must be one of these.
Result<cv::Mat> edge_mask(std::string_view name, std::string_view text);

}  // namespace veneer::daemon
