// Hairs and fibres on the scanner's glass, as they lie over strips of veneer: thin lines that run across the grain and
// stand alone, as neither grain nor a crack does. Internal to veneer_mask. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"

namespace veneer::calib {

struct GlassHair {
  cv::Point2d middle;  // px of the view, centres at +0.5
  double length = 0;   // px
};
struct GlassDust {
  cv::Mat mask;  // CV_8UC1, 255 on what the hairs hide and blur
  std::vector<GlassHair> hairs;
};

// `strips` holds the strips' numbers from 1 (CV_8UC1, 0 elsewhere); `known` is 255 on what is no wood for another
// reason and may have rims of its own: screws, holes, cracks, fiducials.
GlassDust find_glass_dust(const BoardView& view, const cv::Mat& strips, const cv::Mat& known);

}  // namespace veneer::calib
