// A smooth map from picture pixels to raster pixels, exact at the knots of a coarse net and linear between them. The
// maps of the twin's devices bend so little that a net of 8 pixels errs by less than a thousandth of a pixel.
#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>

#include "drivers/sim/plane.h"

namespace veneer::sim {

class CoarseMap {
 public:
  // `source` maps picture pixels to raster pixels, both with centres at +0.5.
  CoarseMap(cv::Size picture, int step, const std::function<Vec2(Vec2)>& source);
  // Maps of rows [first, first + rows) for cv::remap (CV_32FC2, centres at 0). Thread-safe.
  cv::Mat rows(int first, int rows) const;

 private:
  cv::Size picture_;
  int step_;
  cv::Mat knots_;  // CV_32FC2
};

}  // namespace veneer::sim
