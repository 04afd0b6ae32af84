// Shapes that patches may have, and pictures cut into them: curved, concave, with several spans a row of pixels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "base/units.h"
#include "planner/problem/problem.h"

namespace veneer::planner::test {

// A simple polygon that touches all sides of the square from (0, 0) to (1, 1), counter-clockwise, y up.
using Shape = std::vector<std::pair<double, double>>;
using ShapeOf = std::function<Shape(std::size_t number)>;

// Stretched to the square.
inline Shape stretched(Shape shape) {
  double left = 1e9, right = -1e9, low = 1e9, high = -1e9;
  for (const auto& [x, y] : shape)
    left = std::min(left, x), right = std::max(right, x), low = std::min(low, y), high = std::max(high, y);
  for (auto& [x, y] : shape) x = (x - left) / (right - left), y = (y - low) / (high - low);
  return shape;
}

// By quarter turns, counter-clockwise.
inline Shape turned(Shape shape, std::size_t quarters) {
  for (; quarters % 4 != 0; --quarters)
    for (auto& [x, y] : shape) std::tie(x, y) = std::pair(1 - y, x);
  return shape;
}

// Half of the square, its right angle in one of four corners.
inline Shape triangle(std::size_t number) { return turned({{0, 0}, {1, 0}, {1, 1}}, number); }

inline Shape disc(std::size_t /*number*/) {
  constexpr int kCorners = 40;
  Shape out;
  for (int k = 0; k < kCorners; ++k) {
    const double at = 2 * kPi * k / kCorners;
    out.emplace_back(0.5 + 0.5 * std::cos(at), 0.5 + 0.5 * std::sin(at));
  }
  return out;
}

// An L, in four orientations.
inline Shape ell(std::size_t number) {
  return turned({{0, 0}, {1, 0}, {1, 0.35}, {0.4, 0.35}, {0.4, 1}, {0, 1}}, number);
}

// A disc without a smaller one that lies over its border.
inline Shape crescent(std::size_t number) {
  constexpr int kCorners = 24;
  Shape out;
  for (int k = 0; k <= kCorners; ++k) {
    const double at = kPi / 4 + 1.5 * kPi * k / kCorners;
    out.emplace_back(std::cos(at), std::sin(at));
  }
  // Back along the inner arc, from the lower horn to the upper one.
  const double x = std::sqrt(0.5), centre = 0.45, radius = std::hypot(x - centre, x), end = std::atan2(x, x - centre);
  for (int k = kCorners - 1; k > 0; --k) {
    const double at = end + (2 * kPi - 2 * end) * k / kCorners;
    out.emplace_back(centre + radius * std::cos(at), radius * std::sin(at));
  }
  return turned(stretched(out), number);
}

// A segment that winds: up to three spans a row or column.
inline Shape meander(std::size_t number) {
  return turned({{0, 0},
                 {0.62, 0},
                 {0.62, 0.7},
                 {0.72, 0.7},
                 {0.72, 0.1},
                 {1, 0.1},
                 {1, 1},
                 {0.34, 1},
                 {0.34, 0.28},
                 {0.26, 0.28},
                 {0.26, 0.9},
                 {0, 0.9}},
                number);
}

// As seen from a point inside, its border lies nearer here and farther there: often concave.
inline Shape star(std::uint64_t seed) {
  cv::RNG random(seed + 1);
  const int corners = random.uniform(5, 14);
  Shape out;
  for (int k = 0; k < corners; ++k) {
    const double at = 2 * kPi * (k + random.uniform(0.1, 0.9)) / corners, radius = random.uniform(0.35, 1.0);
    out.emplace_back(radius * std::cos(at), radius * std::sin(at));
  }
  return stretched(out);
}

// Replaces the squares of a problem by shapes within them; all share one class.
inline void reshape(Problem& problem, const ShapeOf& shape_of) {
  for (WindowClass& windows : problem.classes) windows.filled = false;
  for (std::size_t i = 0; i < problem.queue.size(); ++i) {
    MatchPatch& patch = problem.queue[i].match;
    const Box<ArtworkFrame> box = bounds(patch.outline);
    patch.outline.clear();
    for (const auto& [x, y] : shape_of(i))
      patch.outline.push_back({box.min.x + box.width() * x, box.min.y + box.height() * y});
    patch.pixels = patch_pixels(patch.outline, patch.grid, patch.features->cols, patch.features->rows);
  }
}

}  // namespace veneer::planner::test
