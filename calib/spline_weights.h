// Uniform cubic B-splines over a row of coefficients: coefficient i is centred at (i - 1) * spacing.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace veneer::calib {

struct SplineWeights {
  int first = 0;  // the first of the four coefficients that act
  std::array<double, 4> w{};
};

// Outside the row the nearest end counts. `count` is at least 4.
inline SplineWeights spline_weights(double place, double spacing, int count) {
  const double s = std::clamp(place / spacing, 0.0, static_cast<double>(count - 3));
  const int first = std::min(static_cast<int>(s), count - 4);
  const double t = s - first, u = 1 - t;
  return {first,
          {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6}};
}

}  // namespace veneer::calib
