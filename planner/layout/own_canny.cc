#include "planner/layout/own_canny.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::planner {
namespace {

// Of the gradients that are no noise, the share that is strong enough to begin an edge.
constexpr double kStrong = 0.85;
constexpr double kWeak = 0.4;          // threshold of what continues an edge, in that of what begins one
constexpr double kBelowAll = 0.99;     // of the largest gradient
constexpr double kLeastGradient = 12;  // of 255 over a pixel, after smoothing: 3 x 3 Sobel

// The value that this share of the non-zero ones does not exceed.
double quantile(const cv::Mat& values, double share) {
  std::vector<float> all;
  for (int r = 0; r < values.rows; ++r)
    for (int c = 0; c < values.cols; ++c)
      if (const float v = values.at<float>(r, c); static_cast<double>(v) > kLeastGradient) all.push_back(v);
  if (all.empty()) return kLeastGradient;
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), at, all.end());
  return static_cast<double>(*at);
}

}  // namespace

cv::Mat own_canny(const cv::Mat& grey, double shortest) {
  cv::Mat dx, dy, edges;
  cv::Sobel(grey, dx, CV_16S, 1, 0);
  cv::Sobel(grey, dy, CV_16S, 0, 1);
  cv::Mat fx, fy, strength;
  dx.convertTo(fx, CV_32F), dy.convertTo(fy, CV_32F);
  cv::magnitude(fx, fy, strength);
  // Canny begins edges where the gradient is larger than that: in a drawing of two tones all may be alike. What is
  // fainter than the least is noise, be it all there is.
  double largest = 0;
  cv::minMaxLoc(strength, nullptr, &largest);
  const double high = std::max(kLeastGradient, std::min(quantile(strength, kStrong), kBelowAll * largest));
  cv::Canny(dx, dy, edges, kWeak * high, high, true);
  cv::Mat numbers, figures, centres;
  cv::connectedComponentsWithStats(edges, numbers, figures, centres, 8, CV_32S);
  // One look at each pixel, however many edges there are.
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c)
      if (figures.at<int>(numbers.at<int>(r, c), cv::CC_STAT_AREA) < shortest) edges.at<std::uint8_t>(r, c) = 0;
  return edges;
}

}  // namespace veneer::planner
