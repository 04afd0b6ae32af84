#include "planner/layout/adaptive_grid.h"

#include <algorithm>

namespace veneer::planner {
namespace {

// What lies within a square of 2^level cells; several trees where the border cuts it.
std::vector<PatchTree> gather(const std::vector<Patch>& cells, GridSize size, int row, int column, int level) {
  const int side = 1 << level;
  if (row >= size.rows || column >= size.columns) return {};
  const auto cell = [&](int r, int c) -> const Patch& {
    return cells[static_cast<std::size_t>(r) * static_cast<std::size_t>(size.columns) + static_cast<std::size_t>(c)];
  };
  if (level == 0) return {{cell(row, column), {}}};
  std::vector<PatchTree> parts;
  for (const int r : {row, row + side / 2})
    for (const int c : {column, column + side / 2})
      for (PatchTree& part : gather(cells, size, r, c, level - 1)) parts.push_back(std::move(part));
  if (row + side > size.rows || column + side > size.columns) return parts;
  const Box<ArtworkFrame> first = bounds(cell(row + side - 1, column).outline);
  const Box<ArtworkFrame> last = bounds(cell(row, column + side - 1).outline);
  const Millimetres left = first.min.x, bottom = first.min.y, right = last.max.x, top = last.max.y;
  return {{{row, column, {{left, bottom}, {right, bottom}, {right, top}, {left, top}}, side}, std::move(parts)}};
}

}  // namespace

std::vector<PatchTree> adaptive_layout(Millimetres width, Millimetres height, Millimetres patch, int levels) {
  const GridSize size = grid_size(width, height, patch);
  const std::vector<Patch> cells = grid_layout(width, height, patch);
  const int side = 1 << levels;
  std::vector<PatchTree> out;
  for (int row = 0; row < size.rows; row += side)
    for (int column = 0; column < size.columns; column += side)
      for (PatchTree& tree : gather(cells, size, row, column, levels)) out.push_back(std::move(tree));
  return out;
}

}  // namespace veneer::planner
