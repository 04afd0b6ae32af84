#include "calib/probe.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

namespace veneer::calib {

cv::Mat darkest_channel(const cv::Mat& picture) {
  if (picture.channels() == 1) return picture;
  std::array<cv::Mat, 3> channels;
  cv::split(picture, channels.data());
  cv::Mat darkest;
  cv::min(channels[0], channels[1], darkest);
  cv::min(darkest, channels[2], darkest);
  return darkest;
}

int top_level(const cv::Mat& grey, double fraction) {
  std::array<double, 256> counts{};
  for (int r = 0; r < grey.rows; ++r) {
    const auto* row = grey.ptr<std::uint8_t>(r);
    for (int c = 0; c < grey.cols; ++c) counts[row[c]] += 1;
  }
  double left = fraction * static_cast<double>(grey.total());
  std::size_t level = 255;
  for (; level > 0 && left >= counts[level]; --level) left -= counts[level];
  return static_cast<int>(level);
}

double level_at(const cv::Mat& grey, double x, double y) {
  x = std::clamp(x - 0.5, 0.0, grey.cols - 1.001);
  y = std::clamp(y - 0.5, 0.0, grey.rows - 1.001);
  const int c = static_cast<int>(x), r = static_cast<int>(y);
  const double fx = x - c, fy = y - r;
  const auto* upper = grey.ptr<std::uint8_t>(r) + c;
  const auto* lower = grey.ptr<std::uint8_t>(r + 1) + c;
  return (1 - fy) * ((1 - fx) * upper[0] + fx * upper[1]) + fy * ((1 - fx) * lower[0] + fx * lower[1]);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace veneer::calib
