#include "planner/morph/spring_grid.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

// m = 1. A vertex alone is held by eight springs, a line that moves as a whole by far weaker ones.
constexpr double kEdgeWeight = 3;   // w, in spacings
constexpr double kDamping = 4;      // gamma
constexpr double kEulerStep = 0.1;  // of Euler's method
constexpr double kAtRest = 0.005;   // pixels a step
constexpr int kMostSteps = 1500;

// The slope of P across the lines, CV_32FC1: along x of upright edges, along y of level ones.
cv::Mat slope_of(const cv::Mat& edges, double reach, bool along_x) {
  cv::Mat distance, slope;
  cv::distanceTransform(~edges, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat potential = cv::min(distance, reach);
  // At an edge itself the slope jumps from -1 to 1, about which a vertex would swing for ever.
  cv::GaussianBlur(potential, potential, {}, 1.5);
  cv::Sobel(potential, slope, CV_32F, along_x ? 1 : 0, along_x ? 0 : 1, 3, 1.0 / 8);
  return slope;
}

double bilinear(const cv::Mat& map, const PlanePoint& p) {
  const double x = std::clamp(p.x - 0.5, 0.0, map.cols - 1.0), y = std::clamp(p.y - 0.5, 0.0, map.rows - 1.0);
  const int c = std::min(static_cast<int>(x), map.cols - 2), r = std::min(static_cast<int>(y), map.rows - 2);
  const double s = x - c, t = y - r;
  const float *upper = map.ptr<float>(r) + c, *lower = map.ptr<float>(r + 1) + c;
  const auto value = [](const float* at) { return static_cast<double>(*at); };
  return (1 - t) * ((1 - s) * value(upper) + s * value(upper + 1)) +
         t * ((1 - s) * value(lower) + s * value(lower + 1));
}

class Springs {
 public:
  Springs(const GridSize& size, double width, double height, const EdgeImage& edges, std::span<const PlanePin> pins)
      : rows_(size.rows), columns_(size.columns), dx_(width / size.columns), dy_(height / size.rows) {
    if (!edges.upright.empty()) slope_x_ = slope_of(edges.upright, dx_ / 2, true);
    if (!edges.level.empty()) slope_y_ = slope_of(edges.level, dy_ / 2, false);
    for (int r = 0; r <= rows_; ++r)
      for (int c = 0; c <= columns_; ++c)
        home_.push_back({width * (static_cast<double>(c) / columns_), height * (static_cast<double>(r) / rows_)});
    // Displacements, not places: springs of equal neighbours cancel to the last bit.
    moved_.assign(home_.size(), {}), speed_ = moved_, pinned_.assign(home_.size(), 0);
    for (const PlanePin& pin : pins) {
      const std::size_t i = number(pin.row, pin.column);
      pinned_[i] = 1, moved_[i] = {pin.at.x - home_[i].x, pin.at.y - home_[i].y};
    }
  }

  SpringGrid run() {
    for (int step = 0; step < kMostSteps && advance() > kAtRest; ++step) {
    }
    limit_leans();
    SpringGrid out{{rows_, columns_}, home_};
    for (std::size_t i = 0; i < home_.size(); ++i) out.vertices[i].x += moved_[i].x, out.vertices[i].y += moved_[i].y;
    return out;
  }

 private:
  std::size_t number(int row, int column) const { return static_cast<std::size_t>(row * (columns_ + 1) + column); }

  // One step of Euler's method for all vertices. Returns how far the fastest goes.
  double advance() {
    next_ = moved_;
    double farthest = 0;
    for (int r = 0; r <= rows_; ++r)
      for (int c = 0; c <= columns_; ++c) {
        const std::size_t i = number(r, c);
        if (pinned_[i] != 0) continue;
        const PlanePoint here = moved_[i];
        PlanePoint force;
        const int above = std::max(r - 1, 0), below = std::min(r + 1, rows_), left = std::max(c - 1, 0),
                  right = std::min(c + 1, columns_);
        for (int row = above; row <= below; ++row) {
          const PlanePoint* neighbour = moved_.data() + number(row, left);
          for (int column = left; column <= right; ++column, ++neighbour)
            force.x += neighbour->x - here.x, force.y += neighbour->y - here.y;
        }
        const PlanePoint place{home_[i].x + here.x, home_[i].y + here.y};
        if (!slope_x_.empty()) force.x -= kEdgeWeight * dx_ * bilinear(slope_x_, place);
        if (!slope_y_.empty()) force.y -= kEdgeWeight * dy_ * bilinear(slope_y_, place);
        PlanePoint& v = speed_[i];
        // Damping is taken implicitly, which holds at any step.
        v.x = c == 0 || c == columns_ ? 0 : (v.x + kEulerStep * force.x) / (1 + kEulerStep * kDamping);
        v.y = r == 0 || r == rows_ ? 0 : (v.y + kEulerStep * force.y) / (1 + kEulerStep * kDamping);
        PlanePoint& next = next_[i];
        next.x = std::clamp(here.x + kEulerStep * v.x, -kFarthest * dx_, kFarthest * dx_);
        next.y = std::clamp(here.y + kEulerStep * v.y, -kFarthest * dy_, kFarthest * dy_);
        farthest = std::max({farthest, std::abs(next.x - here.x), std::abs(next.y - here.y)});
      }
    moved_.swap(next_);
    return farthest;
  }

  // Vertices whose border leans too far give way to each other, both by half; a pinned one leaves it to the other.
  void limit_leans() {
    const auto ease = [&](std::size_t i, std::size_t k, double PlanePoint::*across, double most) {
      double &a = moved_[i].*across, &b = moved_[k].*across;
      const double beyond = std::abs(b - a) - most;
      if (beyond <= 0 || (pinned_[i] != 0 && pinned_[k] != 0)) return;
      const double all = b > a ? beyond : -beyond;
      const double share = pinned_[i] != 0 ? 0 : pinned_[k] != 0 ? 1 : 0.5;
      a += all * share, b -= all * (1 - share);
    };
    constexpr int kPasses = 50;
    for (int pass = 0; pass < kPasses; ++pass) {
      for (int r = 0; r < rows_; ++r)
        for (int c = 1; c < columns_; ++c) ease(number(r, c), number(r + 1, c), &PlanePoint::x, kMostLean * dy_);
      for (int r = 1; r < rows_; ++r)
        for (int c = 0; c < columns_; ++c) ease(number(r, c), number(r, c + 1), &PlanePoint::y, kMostLean * dx_);
    }
  }

  int rows_, columns_;
  double dx_, dy_;
  cv::Mat slope_x_, slope_y_;
  std::vector<PlanePoint> home_, moved_, speed_, next_;
  std::vector<char> pinned_;
};

}  // namespace

SpringGrid spring_grid(const GridSize& size, double width, double height, const EdgeImage& edges,
                       std::span<const PlanePin> pins) {
  return Springs(size, width, height, edges, pins).run();
}

}  // namespace veneer::planner
