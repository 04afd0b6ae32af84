// Patches of several sizes (section 3.3, n_adaptive): squares of 2^k cells of the grid, each cut into four of the next
// smaller size where that pays (adaptive.h).
#pragma once

#include <vector>

#include "planner/layout/grid.h"

namespace veneer::planner {

struct PatchTree {
  Patch patch;
  std::vector<PatchTree> parts;  // none for a single cell
};

// The grid of grid_layout(), gathered from the upper left corner into squares of 2^levels cells; where a border leaves
// no room for one, into smaller squares. In reading order; parts too.
std::vector<PatchTree> adaptive_layout(Millimetres width, Millimetres height, Millimetres patch, int levels);

}  // namespace veneer::planner
