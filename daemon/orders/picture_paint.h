// What somebody painted over a picture with a finger: which of its edges a morphed grid follows, what in it matters,
// and where the cells of a mosaic are small. Coarse, and so short that it is one of a plan's parameters. Pure.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

inline constexpr std::string_view kAllEdges = "all", kEvenImportance = "even", kSalientSizes = "salient";
inline constexpr int kMostEdgeCells = 64, kMostImportanceCells = 48;  // a side

// "all", and then the mask is empty; or WIDTHxHEIGHT:HEX, cells over the whole picture, row by row from its upper left
// corner, four in a digit, the first in its highest bit: set where edges count. 255 there, else 0.
// kInvalidArgument: `name` must be one of these.
Result<cv::Mat> edge_mask(std::string_view name, std::string_view text);

// "even", and then it is empty; or WIDTHxHEIGHT:HEX, a digit for each cell: from 0, not at all, to f, as important as
// can be. 0 to 255 there.
Result<cv::Mat> importance_mask(std::string_view name, std::string_view text);

// "salient", and then it is empty; or the same: f where a mosaic's cells are the smallest, 0 where they are the
// largest.
Result<cv::Mat> cell_size_mask(std::string_view name, std::string_view text);

}  // namespace veneer::daemon
