#include "drivers/sim/noise.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace veneer::sim {

cv::Mat noise_field(Random& random, cv::Size size, double cell_x, double cell_y) {
  const int columns = std::max(1, static_cast<int>(std::ceil(size.width / cell_x))) + 3;
  const int rows = std::max(1, static_cast<int>(std::ceil(size.height / cell_y))) + 3;
  cv::Mat knots(rows, columns, CV_32FC1);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) knots.at<float>(r, c) = static_cast<float>(random.spread(1.0));
  }
  cv::Mat grown;
  const cv::Size full(static_cast<int>(std::ceil(columns * cell_x)), static_cast<int>(std::ceil(rows * cell_y)));
  cv::resize(knots, grown, full, 0, 0, cv::INTER_CUBIC);
  const int x = std::min(static_cast<int>(cell_x * 1.5), grown.cols - size.width);
  const int y = std::min(static_cast<int>(cell_y * 1.5), grown.rows - size.height);
  return grown(cv::Rect(std::max(0, x), std::max(0, y), size.width, size.height));
}

LineNoise::LineNoise(Random& random, int lumps) : knots_(static_cast<std::size_t>(std::max(lumps, 1)) + 4) {
  for (float& k : knots_) k = static_cast<float>(random.spread(1.0));
}

double LineNoise::at(double x) const {
  const double last = static_cast<double>(knots_.size()) - 3.001;
  const double p = std::clamp(x, 0.0, last - 1) + 1;
  const auto i = static_cast<std::size_t>(p);
  const double t = p - static_cast<double>(i);
  const double a = knots_[i - 1], b = knots_[i], c = knots_[i + 1], d = knots_[i + 2];
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

}  // namespace veneer::sim
