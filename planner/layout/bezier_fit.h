// Cubic Bezier curves through sampled paths: least squares with reparametrisation (Schneider 1990).
//
// Units are the caller's. Pure functions; thread-safe.
#pragma once

#include <array>
#include <span>
#include <vector>

namespace veneer::planner {

struct PlanePoint {
  double x = 0, y = 0;
  friend bool operator==(const PlanePoint&, const PlanePoint&) = default;
};

using Cubic = std::array<PlanePoint, 4>;  // from, two controls, to
PlanePoint at(const Cubic& cubic, double t);

// kG0: the curve is continuous, kG1: so is its direction, where one cubic follows another and at both ends.
enum class Smoothness { kG0, kG1 };

// As few cubics, one after the other, as lie within `tolerance` of the path's points and have its ends (at least two
// points, no two that follow each other alike). With kG1 directions at the ends and where curves meet are the path's
// own, `before` and `after` are the points next to its ends where a longer path goes on; null where it ends.
std::vector<Cubic> fit_cubics(std::span<const PlanePoint> path, double tolerance, Smoothness smoothness,
                              const PlanePoint* before = nullptr, const PlanePoint* after = nullptr);

}  // namespace veneer::planner
