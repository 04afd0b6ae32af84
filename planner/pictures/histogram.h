// Gamut mapping, equation 2: F'_intens(I_T) = (1 - w_hist) F_intens(I_T) + w_hist F_equalize(I_T, I_S).
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <stop_token>

#include "base/result.h"

namespace veneer::planner {

// Counts of grey values in [0, 1] in 256 bins; bin i stands for the value i / 255.
struct GreyHistogram {
  std::array<double, 256> counts{};

  // Counts the pixels of a CV_32FC1 picture, each `weight` times; with a CV_8UC1 mask of the same size only where it is
  // non-zero. kCancelled: a stop was requested, and nothing of the picture is counted.
  Status add(const cv::Mat& grey, const cv::Mat& mask, double weight, const std::stop_token& stop);
  void add(const cv::Mat& grey, const cv::Mat& mask = {}, double weight = 1);
  double total() const;
};

// For each of the 256 grey values of the target the value that has the same rank among the source's values.
std::array<float, 256> rank_matching(const GreyHistogram& target, const GreyHistogram& source);

// The target's grey picture (CV_32FC1) with its tones mapped to the source's; w_hist in [0, 1]. Between the 256 values
// the mapping is linear. A source without pixels leaves the target as it is. kCancelled: within a row after a stop was
// requested.
Result<cv::Mat> match_tones(const cv::Mat& target_grey, const GreyHistogram& source, double w_hist,
                            const std::stop_token& stop);
cv::Mat match_tones(const cv::Mat& target_grey, const GreyHistogram& source, double w_hist);

}  // namespace veneer::planner
