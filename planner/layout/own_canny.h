// Canny's edges (1986) with thresholds from the picture's own gradients. Pure function; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::planner {

// The edges of a grey picture (CV_8UC1) that is smooth already: CV_8UC1, 255 on lines one pixel wide. An edge begins
// where the gradient is among the strongest of those that are no noise; lines of fewer than `shortest` pixels are left
// out.
cv::Mat own_canny(const cv::Mat& grey, double shortest);

}  // namespace veneer::planner
