// Finds strips of veneer by their geometry: straight sides, gaps that show the board. Internal to veneer_mask.
// Thread-safe.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"

namespace veneer::calib {

// Four straight sides; a side is the line x = at + tilt * y (left, right) or y = at + tilt * x (top, bottom), in the
// work map's pixels.
struct StripSide {
  double at = 0, tilt = 0;
  double seen = 0;  // how clearly all its length shows a step, in spreads of the board; 0 = it was not seen
};
struct FoundStrip {
  StripSide left, right, top, bottom;
  double unlike = 0;      // median of its places' unlikeness to the board
  double board_band = 0;  // mm: the widest band of it, from end to end, that shows nothing but board
};

// `fiducials` is 255 where tags and holes are.
std::vector<FoundStrip> find_strips(const BoardView& view, const cv::Mat& fiducials);

// Where the sides meet, px with centres at +0.5: lower left, lower right, upper right, upper left.
std::array<cv::Point2d, 4> corners_of(const FoundStrip& strip);
// 255 within the four sides.
cv::Mat draw_strip(const FoundStrip& strip, const cv::Size& size);

}  // namespace veneer::calib
