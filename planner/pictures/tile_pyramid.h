// A large picture in square tiles, at its own resolution and at each half of the one before: what is looked at of it is
// read without the rest. One tiled TIFF with JPEG tiles, a directory for each level, which other programs read as well
// (TIFF 6.0, section 15; Adobe's Technical Note 2). Reads and writes files; thread-safe, does not throw.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::planner {

inline constexpr int kTileSide = 512;  // pixels

// Writes the levels of a CV_8UC3 picture (BGR) or a CV_8UC1 one, the last of which is a single tile, in place of an
// earlier file. A pixel of level k covers 2^k x 2^k of the picture's, from its upper left corner; beyond the right and
// lower borders its last pixels go on. `file` is whole or not there. kInvalidArgument for another kind of picture,
// kStorage for the disk.
Status write_tile_pyramid(const cv::Mat& picture, const std::filesystem::path& file);

// In pixels, level 0 first. kStorage when the file is none of these.
Result<std::vector<cv::Size>> read_pyramid_levels(const std::filesystem::path& file);

// A JPEG file of kTileSide x kTileSide pixels; column and row count from the upper left. kNotFound: the picture has no
// such tile. kStorage when the file cannot be read.
Result<std::string> read_pyramid_tile(const std::filesystem::path& file, int level, int column, int row);

}  // namespace veneer::planner
