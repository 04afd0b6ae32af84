// Filter responses of equation 1: F(I) = (w_intens * F_intens(I), w_edge * F_edge(I), ...)^T.
//
// The bank is open: a filter is one entry of the list in features.cc with its weight in PlanOptions. The wood is
// turned against the picture and its maps are sampled where a turned piece would lie, so a filter must answer alike
// however the picture is turned: oriented filters (Gabor, Leung and Malik) enter by the strongest of their answers.
// Responses are not negative. A filter whose weight is 0 is left out. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "planner/plan.h"

namespace veneer::planner {

// A picture as the filters see it.
struct FilterInput {
  cv::Mat bgr;        // CV_8UC3 at the working resolution
  cv::Mat grey;       // grey_of(bgr)
  cv::Mat intensity;  // grey, of a target after gamut mapping; all other filters work on what was there before it
  ScanResolution resolution;
  cv::Mat chroma{};  // CV_32FC2, a* and b* of a target after gamut mapping (wood_colours.h); empty: those of `bgr`
};

// CV_32FC(n), n = number of channels in use, each multiplied by its weight. Works in bands of rows, on
// options.threads; the calling one is one of them. kCancelled: within a band after a stop was requested.
Result<cv::Mat> filter_bank(const FilterInput& input, const PlanOptions& options, const std::stop_token& stop);
cv::Mat filter_bank(const FilterInput& input, const PlanOptions& options);

// The largest value a channel of filter_bank() can have.
double largest_response(const PlanOptions& options);

// kInvalidArgument: a weight lies outside [0, 1] or is not a number, or all are 0.
Status check_weights(const PlanOptions& options);

// CV_32FC1 in [0, 1]: BT.601 of the sRGB values of a CV_8UC3 BGR picture. kCancelled: within a row after a stop was
// requested.
Result<cv::Mat> grey_of(const cv::Mat& bgr, const std::stop_token& stop);
cv::Mat grey_of(const cv::Mat& bgr);

// CV_32FC1: 0.25 * |3x3 Sobel|, at most sqrt(2).
cv::Mat edges_of(const cv::Mat& grey);

// The same after smoothing by a Gaussian of this standard deviation, scaled so that a step from black to white still
// answers 1. 0 pixels: edges_of(grey).
cv::Mat edges_at_scale(const cv::Mat& grey, Pixels sigma);

}  // namespace veneer::planner
