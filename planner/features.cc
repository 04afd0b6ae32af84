#include "planner/features.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

constexpr double kLargestIntensity = 1.0;
constexpr double kLargestEdge = 1.4143;

}  // namespace

cv::Mat grey_of(const cv::Mat& bgr) {
  cv::Mat grey(bgr.size(), CV_32FC1);
  for (int r = 0; r < bgr.rows; ++r) {
    const auto* from = bgr.ptr<cv::Vec3b>(r);
    auto* to = grey.ptr<float>(r);
    for (int c = 0; c < bgr.cols; ++c)
      to[c] = (0.114F * static_cast<float>(from[c][0]) + 0.587F * static_cast<float>(from[c][1]) +
               0.299F * static_cast<float>(from[c][2])) /
              255.0F;
  }
  return grey;
}

cv::Mat edges_of(const cv::Mat& grey) {
  cv::Mat across, down, magnitude;
  cv::Sobel(grey, across, CV_32F, 1, 0, 3, 0.25);
  cv::Sobel(grey, down, CV_32F, 0, 1, 3, 0.25);
  cv::magnitude(across, down, magnitude);
  return magnitude;
}

std::vector<double> channel_weights(const PlanOptions& options) {
  std::vector<double> weights;
  if (options.w_intensity > 0) weights.push_back(options.w_intensity);
  if (options.w_edge > 0) weights.push_back(options.w_edge);
  return weights;
}

cv::Mat filter_bank(const cv::Mat& intensity, const cv::Mat& grey, const PlanOptions& options) {
  std::vector<cv::Mat> channels;
  if (options.w_intensity > 0) channels.emplace_back(intensity * options.w_intensity);
  if (options.w_edge > 0) channels.emplace_back(edges_of(grey) * options.w_edge);
  cv::Mat responses;
  cv::merge(channels, responses);
  return responses;
}

double largest_response(const PlanOptions& options) {
  return std::max(options.w_intensity * kLargestIntensity, options.w_edge * kLargestEdge);
}

}  // namespace veneer::planner
