#include "drivers/sim/coarse_map.h"

#include <opencv2/core.hpp>

namespace veneer::sim {

CoarseMap::CoarseMap(cv::Size picture, int step, const std::function<Vec2(Vec2)>& source)
    : picture_(picture), step_(step), knots_(picture.height / step + 2, picture.width / step + 2, CV_32FC2) {
  cv::parallel_for_(cv::Range(0, knots_.rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      for (int c = 0; c < knots_.cols; ++c) {
        const Vec2 p = source({c * step_ + 0.5, r * step_ + 0.5});
        knots_.at<cv::Vec2f>(r, c) = {static_cast<float>(p.x - 0.5), static_cast<float>(p.y - 0.5)};
      }
    }
  });
}

cv::Mat CoarseMap::rows(int first, int rows) const {
  cv::Mat out(rows, picture_.width, CV_32FC2);
  std::vector<cv::Vec2f> line(static_cast<std::size_t>(knots_.cols));
  for (int r = 0; r < rows; ++r) {
    const int knot = (first + r) / step_;
    const float down = static_cast<float>(first + r - knot * step_) / static_cast<float>(step_);
    const auto *above = knots_.ptr<cv::Vec2f>(knot), *below = knots_.ptr<cv::Vec2f>(knot + 1);
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = above[i] * (1 - down) + below[i] * down;
    auto* row = out.ptr<cv::Vec2f>(r);
    for (int c = 0; c < picture_.width; c += step_) {
      const cv::Vec2f from = line[static_cast<std::size_t>(c / step_)];
      const cv::Vec2f slope = (line[static_cast<std::size_t>(c / step_) + 1] - from) / static_cast<float>(step_);
      const int end = std::min(step_, picture_.width - c);
      for (int k = 0; k < end; ++k) row[c + k] = from + slope * static_cast<float>(k);
    }
  }
  return out;
}

}  // namespace veneer::sim
