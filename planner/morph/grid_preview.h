// The lines of a morphed grid and where they meet, for a person to look at and to pin. Pure; thread-safe.
#pragma once

#include <vector>

#include "base/geometry.h"
#include "planner/boundaries/cut_lines.h"
#include "planner/layout/grid.h"

namespace veneer::planner {

struct GridPreview {
  GridSize size;
  std::vector<Point<ArtworkFrame>> vertices;  // row by row from above, (rows + 1) x (columns + 1)
  // Those within the artwork, some points a cell: upright ones from the left, each from above; then level ones from
  // above, each from the left.
  std::vector<std::vector<Point<ArtworkFrame>>> lines;
};

// `lines`: those of a grid of this size, in the order of grid_lines() (fitted_lines.h), over any raster.
GridPreview grid_preview(const CutLines& lines, const GridSize& size, Millimetres width, Millimetres height);

}  // namespace veneer::planner
