// Small holes through a strip, of some 2 to 3.5 mm, that show the lid behind the board. In wood as pale or as grey as
// the lid they differ from it neither in colour nor, on the whole, in lightness: what tells them is that the lid is
// shaded along their rim and lit in their middle, on all sides alike, and shows no grain. Internal to veneer_mask.
// Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"
#include "calib/round_rim.h"

namespace veneer::calib {

// `strip` is 255 on the strip, `box` bounds it. In the view's pixels.
std::vector<ScrewSpot> find_lid_holes(const BoardView& view, const cv::Mat& strip, const cv::Rect& box);

}  // namespace veneer::calib
