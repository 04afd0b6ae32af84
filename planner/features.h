// Filter responses of equation 1: F(I) = (w_intens * F_intens(I), w_edge * F_edge(I))^T.
//
// A channel whose weight is 0 is left out, so feature vectors have as many entries as there are weights above 0. A
// further filter is one more entry of filter_bank(). Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

// CV_32FC1 in [0, 1]: BT.601 of the sRGB values of a CV_8UC3 BGR picture.
cv::Mat grey_of(const cv::Mat& bgr);

// CV_32FC1: 0.25 * |3x3 Sobel|, at most sqrt(2).
cv::Mat edges_of(const cv::Mat& grey);

// The weights of the channels in use, in the order of filter_bank().
std::vector<double> channel_weights(const PlanOptions& options);

// CV_32FC(n), n = number of channels in use. `intensity` is the grey picture, for a target after gamut mapping; `grey`
// is the one before it, on which all other filters work.
cv::Mat filter_bank(const cv::Mat& intensity, const cv::Mat& grey, const PlanOptions& options);

// The largest value a channel of filter_bank() can have.
double largest_response(const PlanOptions& options);

}  // namespace veneer::planner
