// Directions of what looks the same after a quarter turn, and the middle one of many figures. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace veneer::planner {

// Degrees between two directions, in radians, that are known up to quarter turns: 0 to 45.
inline double degrees_apart(double a, double b) {
  return std::abs(std::remainder(a - b, std::numbers::pi / 2)) * 180 / std::numbers::pi;
}

// Of an even number the upper one of the two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace veneer::planner
