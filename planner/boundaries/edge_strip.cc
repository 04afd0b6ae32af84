#include "planner/boundaries/edge_strip.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

// A way that leans by kLeanLimit quanta in a part of kLeanQuanta turns by 40 degrees from its edge.
constexpr int kLeanLimit = 5, kLeanQuanta = 6;
constexpr std::size_t kLeanStates = 2 * kLeanLimit + 1;
constexpr double kNormalReach = 4;  // pixels before and after a place, whose direction is that of the edge there
constexpr double kEndLean = 0.36;   // 20 degrees: how far an edge may turn where it ends, or it meets others at spikes
constexpr double kEndShare = 0.3;   // of the gap between edges that meet, of the way from where they do

// As many places as steps of about a pixel need, evenly along the path.
std::vector<PlanePoint> resampled(std::span<const PlanePoint> path) {
  std::vector<double> along{0};
  for (std::size_t i = 1; i < path.size(); ++i)
    along.push_back(along.back() + std::hypot(path[i].x - path[i - 1].x, path[i].y - path[i - 1].y));
  const int steps = std::max(1, static_cast<int>(std::lround(along.back())));
  std::vector<PlanePoint> out{path.front()};
  std::size_t i = 1;
  for (int k = 1; k < steps; ++k) {
    const double at = along.back() * k / steps;
    while (along[i] < at) ++i;
    const double t = (at - along[i - 1]) / (along[i] - along[i - 1]);
    out.push_back({path[i - 1].x + t * (path[i].x - path[i - 1].x), path[i - 1].y + t * (path[i].y - path[i - 1].y)});
  }
  out.push_back(path.back());
  return out;
}

double distance_from(const std::vector<PlanePoint>& path, const PlanePoint& p) {
  double least = std::hypot(p.x - path[0].x, p.y - path[0].y);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const PlanePoint& a = path[i - 1];
    const double dx = path[i].x - a.x, dy = path[i].y - a.y, square = std::max(1e-12, dx * dx + dy * dy);
    const double t = std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0, 1.0);
    least = std::min(least, std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy));
  }
  return least;
}

// Distances from drawn paths over a window.
class Distances {
 public:
  Distances(cv::Rect window, std::span<const std::vector<PlanePoint>> paths) : window_(window) {
    constexpr int kShift = 4;
    cv::Mat away(window.size(), CV_8UC1, cv::Scalar(255));
    for (const std::vector<PlanePoint>& path : paths) {
      std::vector<cv::Point> corners;
      corners.reserve(path.size());
      for (const PlanePoint& p : path)
        corners.emplace_back(cvRound((p.x - window.x - 0.5) * (1 << kShift)),
                             cvRound((p.y - window.y - 0.5) * (1 << kShift)));
      cv::polylines(away, std::vector<std::vector<cv::Point>>{corners}, false, cv::Scalar(0), 1, cv::LINE_8, kShift);
    }
    cv::distanceTransform(away, map_, cv::DIST_L2, cv::DIST_MASK_5);
  }
  double operator()(const PlanePoint& p) const {
    const int c = std::clamp(static_cast<int>(std::floor(p.x)) - window_.x, 0, map_.cols - 1);
    const int r = std::clamp(static_cast<int>(std::floor(p.y)) - window_.y, 0, map_.rows - 1);
    return static_cast<double>(map_.at<float>(r, c));
  }

 private:
  cv::Rect window_;
  cv::Mat map_;
};

cv::Rect window_around(std::span<const PlanePoint> path, double reach) {
  double left = path[0].x, right = left, top = path[0].y, bottom = top;
  for (const PlanePoint& p : path)
    left = std::min(left, p.x), right = std::max(right, p.x), top = std::min(top, p.y), bottom = std::max(bottom, p.y);
  const cv::Point from(static_cast<int>(std::floor(left - reach)) - 1, static_cast<int>(std::floor(top - reach)) - 1);
  const cv::Point to(static_cast<int>(std::ceil(right + reach)) + 2, static_cast<int>(std::ceil(bottom + reach)) + 2);
  return {from, to};
}

float cost_at(const FaceCost& face, const PlanePoint& p) {
  const int c = static_cast<int>(std::floor(p.x)) - face.window.x,
            r = static_cast<int>(std::floor(p.y)) - face.window.y;
  if (r < 0 || c < 0 || r >= face.window.height || c >= face.window.width) return kForbidden;
  return face.cost.at<float>(r, c);
}

}  // namespace

EdgeStrip::EdgeStrip(std::span<const PlanePoint> path, const std::vector<PlanePoint>& home,
                     std::span<const std::vector<PlanePoint>> others, double reach, double gap)
    : reach_(std::max(1.0, std::floor(reach))),
      width_(2 * static_cast<std::size_t>(reach_) + 1),
      points_(resampled(path)),
      low_(points_.size(), 0),
      high_(points_.size(), 0) {
  const std::size_t last = points_.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const auto far = static_cast<std::size_t>(kNormalReach);
    const PlanePoint &from = points_[i > far ? i - far : 0], &to = points_[std::min(last, i + far)];
    const double dx = to.x - from.x, dy = to.y - from.y, length = std::max(1e-9, std::hypot(dx, dy));
    normals_.push_back({dy / length, -dx / length});
  }
  // As far as an edge may lie that keeps this one from going its whole reach.
  const cv::Rect window = window_around(points_, 2 * reach_ + gap);
  const std::vector<std::vector<PlanePoint>> itself{points_};
  const Distances to_own(window, itself), to_others(window, others);
  for (std::size_t i = 1; i < last; ++i) {
    const auto from_end = static_cast<double>(std::min(i, last - i));
    const double apart = std::min(gap, kEndShare * from_end);
    const auto to_end = [&](const PlanePoint& p) {
      return std::min(std::hypot(p.x - path.front().x, p.y - path.front().y),
                      std::hypot(p.x - path.back().x, p.y - path.back().y));
    };
    const auto is_own = [&](double aside) {
      const PlanePoint p = at(i, aside);
      const double own = to_own(p);
      // Where the edge bends, another part of it may be nearer.
      return own >= 0.7 * std::abs(aside) - 1 && to_others(p) - own >= apart &&
             distance_from(home, p) <= std::min(reach_, kEndLean * to_end(p));
    };
    const double most = std::min(reach_, from_end);
    for (const double side : {-1.0, 1.0}) {
      double far = 0;
      while (far + 1 <= most && is_own(side * (far + 1))) far += 1;
      (side < 0 ? low_[i] : high_[i]) = side * far;
    }
  }
}

EdgeStrip::Costs EdgeStrip::costs(const FaceCost& left, const FaceCost& right) const {
  Costs out{std::vector<double>(points_.size() * width_, 0)};
  const std::size_t last = points_.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(last, i + 1);
    double* sums = out.sums.data() + i * width_;
    for (std::size_t k = 1; k < width_; ++k) {
      const double aside = static_cast<double>(k) - reach_ - 0.5;
      // Of the pixel between places: the strip is wider on the outer side of a bend.
      const PlanePoint a = at(before, aside), b = at(after, aside);
      const double area =
          std::hypot(b.x - a.x, b.y - a.y) / static_cast<double>(std::max<std::size_t>(1, after - before));
      const PlanePoint p = at(i, aside);
      sums[k] = sums[k - 1] + area * (static_cast<double>(cost_at(right, p)) - static_cast<double>(cost_at(left, p)));
    }
    // Costs count from what the edge itself has.
    const double none = sums[static_cast<std::size_t>(reach_)];
    for (std::size_t k = 0; k < width_; ++k) {
      const double aside = static_cast<double>(k) - reach_;
      const double beyond = std::max({0.0, low_[i] - aside, aside - high_[i]});
      sums[k] = beyond > 0 ? static_cast<double>(kForbidden) * (beyond + 1) : sums[k] - none;
    }
  }
  return out;
}

// Of a straight part between two places along.
double EdgeStrip::cost_of_part(const Costs& costs, double from, double to, double begin, double end) const {
  double sum = 0;
  for (auto i = static_cast<std::size_t>(std::ceil(from)); static_cast<double>(i) < to; ++i) {
    const double place = begin + (static_cast<double>(i) - from) / (to - from) * (end - begin) + reach_;
    const auto k = std::min(static_cast<std::size_t>(std::max(0.0, place)), width_ - 2);
    const double* row = costs.sums.data() + i * width_;
    sum += row[k] + (place - static_cast<double>(k)) * (row[k + 1] - row[k]);
  }
  return sum;
}

std::vector<double> EdgeStrip::spline(const std::vector<double>& controls) const {
  const auto last = static_cast<std::ptrdiff_t>(controls.size()) - 1;
  const auto control = [&](std::ptrdiff_t k) {
    if (k < 0) return 2 * controls.front() - controls[1];
    return k > last ? 2 * controls.back() - controls[static_cast<std::size_t>(last - 1)]
                    : controls[static_cast<std::size_t>(k)];
  };
  std::vector<double> out(points_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double place = static_cast<double>(i) * static_cast<double>(last) / static_cast<double>(out.size() - 1);
    const auto k = static_cast<std::ptrdiff_t>(place);
    const double t = place - static_cast<double>(k), s = 1 - t;
    out[i] = (s * s * s * control(k - 1) + (3 * t * t * t - 6 * t * t + 4) * control(k) +
              (3 * s * s * s - 6 * s * s + 4) * control(k + 1) + t * t * t * control(k + 2)) /
             6;
  }
  out.front() = controls.front(), out.back() = controls.back();
  return out;
}

std::vector<double> EdgeStrip::cheapest(const Costs& costs, double stride, double bend) const {
  const auto steps = static_cast<double>(points_.size() - 1);
  const auto parts = static_cast<std::size_t>(std::max(1L, std::lround(steps / stride)));
  std::vector<double> controls(parts + 1, 0);
  if (parts < 2) return spline(controls);
  const double length = steps / static_cast<double>(parts), quantum = length / kLeanQuanta;
  // Places are quanta aside, middle + place * quantum; leans those between a part's ends.
  const int middle = static_cast<int>(std::floor(reach_ / quantum));
  const auto places = static_cast<std::size_t>(2 * middle + 1);
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> total(places * kLeanStates, kNever), next(total.size());
  std::vector<std::int16_t> came(parts * total.size(), 0);
  for (std::size_t part = 0; part < parts; ++part) {
    std::fill(next.begin(), next.end(), kNever);
    const double from = static_cast<double>(part) * length;
    for (int place = 0; place < static_cast<int>(places); ++place) {
      if (part == 0 && place != middle) continue;
      const double* so_far = total.data() + static_cast<std::size_t>(place) * kLeanStates;
      if (part > 0 && *std::min_element(so_far, so_far + kLeanStates) == kNever) continue;
      for (int lean = -kLeanLimit; lean <= kLeanLimit; ++lean) {
        const int there = place + lean;
        if (there < 0 || there >= static_cast<int>(places) || (part + 1 == parts && there != middle)) continue;
        double best = part == 0 ? 0 : kNever;
        int best_was = 0;
        for (int was = -kLeanLimit; part > 0 && was <= kLeanLimit; ++was) {
          const double turned = so_far[was + kLeanLimit] + bend * (lean - was) * (lean - was);
          if (turned < best) best = turned, best_was = was;
        }
        const std::size_t state =
            static_cast<std::size_t>(there) * kLeanStates + static_cast<std::size_t>(lean + kLeanLimit);
        next[state] =
            best + cost_of_part(costs, from, from + length, (place - middle) * quantum, (there - middle) * quantum);
        came[part * total.size() + state] = static_cast<std::int16_t>(best_was);
      }
    }
    std::swap(total, next);
  }
  const double* ends = total.data() + static_cast<std::size_t>(middle) * kLeanStates;
  int lean = static_cast<int>(std::min_element(ends, ends + kLeanStates) - ends) - kLeanLimit, place = middle;
  for (std::size_t part = parts; part-- > 0;) {
    const std::size_t state =
        static_cast<std::size_t>(place) * kLeanStates + static_cast<std::size_t>(lean + kLeanLimit);
    controls[part + 1] = (place - middle) * quantum;
    place -= lean, lean = came[part * total.size() + state];
  }
  return spline(controls);
}

}  // namespace veneer::planner
