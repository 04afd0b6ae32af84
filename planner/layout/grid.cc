#include "planner/layout/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace veneer::planner {

GridSize grid_size(Millimetres width, Millimetres height, Millimetres patch) {
  const auto count = [&](Millimetres side) { return std::max(1, static_cast<int>(std::lround(side / patch))); };
  return {count(height), count(width)};
}

std::vector<Patch> grid_layout(Millimetres width, Millimetres height, Millimetres patch) {
  const GridSize size = grid_size(width, height, patch);
  const auto x = [&](int column) { return width * (static_cast<double>(column) / size.columns); };
  const auto y = [&](int row) { return height * (static_cast<double>(size.rows - row) / size.rows); };
  std::vector<Patch> patches;
  patches.reserve(static_cast<std::size_t>(size.rows) * static_cast<std::size_t>(size.columns));
  for (int row = 0; row < size.rows; ++row) {
    for (int column = 0; column < size.columns; ++column) {
      const Millimetres left = x(column), right = x(column + 1), bottom = y(row + 1), top = y(row);
      patches.push_back({row, column, {{left, bottom}, {right, bottom}, {right, top}, {left, top}}});
    }
  }
  return patches;
}

std::string mark_of(const std::string& letter, const Patch& patch) {
  if (patch.number != Patch::kInGrid) return fmt::format("{}{}", letter, patch.number + 1);
  return fmt::format("{}{}-{}", letter, patch.row + 1, patch.column + 1);
}

}  // namespace veneer::planner
