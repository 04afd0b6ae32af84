#include "planner/layout/bezier_fit.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace veneer::planner {
namespace {

PlanePoint operator+(const PlanePoint& a, const PlanePoint& b) { return {a.x + b.x, a.y + b.y}; }
PlanePoint operator-(const PlanePoint& a, const PlanePoint& b) { return {a.x - b.x, a.y - b.y}; }
PlanePoint operator*(const PlanePoint& a, double f) { return {a.x * f, a.y * f}; }
double dot(const PlanePoint& a, const PlanePoint& b) { return a.x * b.x + a.y * b.y; }
double length(const PlanePoint& a) { return std::hypot(a.x, a.y); }

PlanePoint slope_at(const Cubic& c, double t) {
  const double s = 1 - t;
  return ((c[1] - c[0]) * (s * s) + (c[2] - c[1]) * (2 * s * t) + (c[3] - c[2]) * (t * t)) * 3;
}

PlanePoint bend_at(const Cubic& c, double t) {
  return ((c[2] - c[1] * 2 + c[0]) * (1 - t) + (c[3] - c[2] * 2 + c[1]) * t) * 6;
}

// One cubic through part of a path.
class Fit {
 public:
  // Directions: of the curve at its ends, unit vectors; none: free.
  struct Ends {
    std::optional<PlanePoint> from, to;
  };
  Fit(std::span<const PlanePoint> points, const Ends& ends) : points_(points), ends_(ends) {
    times_.push_back(0);
    for (std::size_t i = 1; i < points.size(); ++i) times_.push_back(times_.back() + length(points[i] - points[i - 1]));
    for (double& t : times_) t /= times_.back();
  }

  // Within `tolerance` of all points, or none.
  std::optional<Cubic> within(double tolerance) {
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      const Cubic cubic = solved();
      const double error = farthest(cubic);
      if (error <= tolerance) return cubic;
      if (error > 16 * tolerance) return std::nullopt;
      reparametrise(cubic);
    }
    return std::nullopt;
  }

 private:
  Cubic solved() const {
    const PlanePoint &from = points_.front(), &to = points_.back();
    const double chord = length(to - from);
    if (points_.size() == 2) return {from, from + (to - from) * (1 / 3.0), to - (to - from) * (1 / 3.0), to};
    return ends_.from && ends_.to ? with_directions(from, to, chord) : with_free_controls(from, to);
  }

  // Controls on the end tangents: their distances are unknown.
  Cubic with_directions(const PlanePoint& from, const PlanePoint& to, double chord) const {
    double c00 = 0, c01 = 0, c11 = 0, x0 = 0, x1 = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double t = times_[i], s = 1 - t, b1 = 3 * s * s * t, b2 = 3 * s * t * t;
      const PlanePoint a0 = *ends_.from * b1, a1 = *ends_.to * -b2;
      const PlanePoint rest = points_[i] - from * (s * s * s + b1) - to * (b2 + t * t * t);
      c00 += dot(a0, a0), c01 += dot(a0, a1), c11 += dot(a1, a1), x0 += dot(a0, rest), x1 += dot(a1, rest);
    }
    const double det = c00 * c11 - c01 * c01;
    double first = chord / 3, last = chord / 3;
    if (std::abs(det) > 1e-12 * c00 * c11) first = (x0 * c11 - x1 * c01) / det, last = (c00 * x1 - c01 * x0) / det;
    // Controls that run backwards or cross make loops.
    if (!(first > 1e-3 * chord && first < chord)) first = chord / 3;
    if (!(last > 1e-3 * chord && last < chord)) last = chord / 3;
    return {from, from + *ends_.from * first, to - *ends_.to * last, to};
  }

  Cubic with_free_controls(const PlanePoint& from, const PlanePoint& to) const {
    double c00 = 0, c01 = 0, c11 = 0;
    PlanePoint r0, r1;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double t = times_[i], s = 1 - t, b1 = 3 * s * s * t, b2 = 3 * s * t * t;
      const PlanePoint rest = points_[i] - from * (s * s * s) - to * (t * t * t);
      c00 += b1 * b1, c01 += b1 * b2, c11 += b2 * b2;
      r0 = r0 + rest * b1, r1 = r1 + rest * b2;
    }
    const double det = c00 * c11 - c01 * c01;
    if (!(std::abs(det) > 1e-9 * c00 * c11)) {
      const PlanePoint third = (to - from) * (1 / 3.0);
      return {from, from + third, to - third, to};
    }
    return {from, (r0 * c11 - r1 * c01) * (1 / det), (r1 * c00 - r0 * c01) * (1 / det), to};
  }

  double farthest(const Cubic& cubic) const {
    double most = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) most = std::max(most, length(at(cubic, times_[i]) - points_[i]));
    return most;
  }

  // A step of Newton's method towards each point's nearest time.
  void reparametrise(const Cubic& cubic) {
    for (std::size_t i = 1; i + 1 < times_.size(); ++i) {
      const double t = times_[i];
      const PlanePoint off = at(cubic, t) - points_[i], slope = slope_at(cubic, t), bend = bend_at(cubic, t);
      const double turn = dot(slope, slope) + dot(off, bend);
      if (turn > 0) times_[i] = std::clamp(t - dot(off, slope) / turn, times_[i - 1], 1.0);
    }
  }

  std::span<const PlanePoint> points_;
  Ends ends_;
  std::vector<double> times_;
};

}  // namespace

PlanePoint at(const Cubic& c, double t) {
  const double s = 1 - t;
  return c[0] * (s * s * s) + c[1] * (3 * s * s * t) + c[2] * (3 * s * t * t) + c[3] * (t * t * t);
}

std::vector<Cubic> fit_cubics(std::span<const PlanePoint> path, double tolerance, Smoothness smoothness,
                              const PlanePoint* before, const PlanePoint* after) {
  const auto direction = [&](std::size_t i) -> std::optional<PlanePoint> {
    if (smoothness == Smoothness::kG0) return std::nullopt;
    const PlanePoint& from = i > 0 ? path[i - 1] : before != nullptr ? *before : path[i];
    const PlanePoint& to = i + 1 < path.size() ? path[i + 1] : after != nullptr ? *after : path[i];
    const PlanePoint along = to - from;
    return along * (1 / length(along));
  };
  const auto fitted = [&](std::size_t from, std::size_t to) {
    return Fit(path.subspan(from, to - from + 1), {direction(from), direction(to)}).within(tolerance);
  };
  std::vector<Cubic> out;
  for (std::size_t from = 0; from + 1 < path.size();) {
    // The longest part that one cubic follows; two points are always followed.
    std::size_t good = from + 1;
    std::optional<Cubic> best = fitted(from, path.size() - 1);
    if (best) {
      good = path.size() - 1;
    } else {
      std::size_t bad = path.size() - 1;
      while (bad - good > 1) {
        const std::size_t middle = (good + bad) / 2;
        if (std::optional<Cubic> cubic = fitted(from, middle))
          good = middle, best = cubic;
        else
          bad = middle;
      }
      if (!best) best = fitted(from, good);
    }
    const PlanePoint third = (path[good] - path[from]) * (1 / 3.0);
    out.push_back(best ? *best : Cubic{path[from], path[from] + third, path[good] - third, path[good]});
    from = good;
  }
  return out;
}

}  // namespace veneer::planner
