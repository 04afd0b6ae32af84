// The least value that is as large as a share p, 0 to 1, of all; 0 of none.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace veneer::tests {

inline double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(p * static_cast<double>(values.size())))];
}

}  // namespace veneer::tests
