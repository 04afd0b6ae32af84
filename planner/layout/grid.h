// The Cartesian layout of section 3.4: patches on a regular grid, stretched so that they cover the whole artwork.
#pragma once

#include <string>
#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

// One cell of a layout.
struct Patch {
  int row = 0, column = 0;     // counted from 0 at the upper left; of a larger patch its upper left cell
  Ring<ArtworkFrame> outline;  // counter-clockwise; of a grid convex
  int cells = 1;               // side of the patch in cells of the grid
  int number = kInGrid;        // place in reading order, counted from 0, where a layout has no rows and columns
  static constexpr int kInGrid = -1;
};

// Rows and columns: max(1, round(side / patch)) per axis.
struct GridSize {
  int rows = 1, columns = 1;
};
GridSize grid_size(Millimetres width, Millimetres height, Millimetres patch);

// In reading order.
std::vector<Patch> grid_layout(Millimetres width, Millimetres height, Millimetres patch);

// The mark that tells a place. "A3-12": letter, row and column counted from 1. Without rows "A312": letter and number,
// counted from 1.
std::string mark_of(const std::string& letter, const Patch& patch);

}  // namespace veneer::planner
