#include "planner/layout/edge_ends.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::planner {
namespace {

constexpr std::size_t kSeen = 6;  // pixels of an edge that say which way its end points
const std::array<cv::Point, 8> kAround{{{-1, 0}, {-1, -1}, {0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}}};

class LooseEnds {
 public:
  explicit LooseEnds(const cv::Mat& edges) : edges_(edges) {}

  bool is_edge(const cv::Point& p) const {
    return cv::Rect({0, 0}, edges_.size()).contains(p) && edges_.at<std::uint8_t>(p) != 0;
  }

  // Whether the line goes on from here one way only: what is beside the pixel is one other, or two that touch.
  bool is_end(const cv::Point& p) const {
    int beside = 0, groups = 0;
    for (std::size_t k = 0; k < kAround.size(); ++k) {
      if (!is_edge(p + kAround[k])) continue;
      ++beside;
      groups += is_edge(p + kAround[(k + kAround.size() - 1) % kAround.size()]) ? 0 : 1;
    }
    return groups == 1 && beside <= 2;
  }

  // The line's last pixels, from its end back.
  std::vector<cv::Point> last_pixels(const cv::Point& end) const {
    std::vector<cv::Point> way{end};
    while (way.size() < kSeen) {
      const cv::Point* next = nullptr;
      cv::Point found;
      double farthest = 0;
      for (const cv::Point& step : kAround) {
        const cv::Point q = way.back() + step;
        if (!is_edge(q) || std::ranges::find(way, q) != way.end()) continue;
        if (const double far = cv::norm(q - end); far > farthest) farthest = far, found = q, next = &found;
      }
      if (next == nullptr) break;
      way.push_back(*next);
    }
    return way;
  }

  // Draws the line on, straight, as far as the next edge.
  void lead_on(const cv::Point& end, double length, cv::Mat& out) const {
    const std::vector<cv::Point> way = last_pixels(end);
    const auto is_other = [&](const cv::Point& p) { return is_edge(p) && std::ranges::find(way, p) == way.end(); };
    const cv::Point2d direction(end - way.back());
    const cv::Point2d to = cv::Point2d(end) + direction * (length / cv::norm(direction));
    cv::LineIterator at(out, end, {cvRound(to.x), cvRound(to.y)});
    cv::Point before = end;
    for (int i = 1; i < at.count; ++i) {
      ++at;
      const cv::Point here = at.pos();
      // An edge that runs aslant would be passed between two of its pixels.
      if (is_other(here) || (is_other({here.x, before.y}) && is_other({before.x, here.y}))) return;
      out.at<std::uint8_t>(here) = 255;
      before = here;
    }
  }

 private:
  const cv::Mat& edges_;
};

}  // namespace

cv::Mat with_longer_ends(const cv::Mat& edges, double length) {
  cv::Mat out = edges.clone();
  const LooseEnds ends(edges);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c) {
      const cv::Point end(c, r);
      if (ends.is_edge(end) && ends.is_end(end)) ends.lead_on(end, length, out);
    }
  return out;
}

}  // namespace veneer::planner
