// The least value that is as large as a share p, 0 to 1, of all (the nearest rank); 0 of none.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace veneer::tests {

inline double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double rounding = 1e-9;  // of p times the count
  const double rank = std::ceil(p * static_cast<double>(values.size()) - rounding);
  return values[rank < 1 ? 0 : std::min(values.size(), static_cast<std::size_t>(rank)) - 1];
}

}  // namespace veneer::tests
