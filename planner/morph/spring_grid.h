// Vertices of a grid drawn to the picture's edges by a damped mass-spring system (paper, section 3.4, equations 6, 7).
//
// Symbols of the paper: vertices x_i, mass m, damping gamma, weight w of the edges, E the edge image, D(E) its distance
// transform, r the edges' reach, half the grid's spacing. Two things differ. P = min(D, r): the paper's
// max(0, min(D, r - D)) repels what lies farther than r / 2 from an edge. And an edge pulls only across the lines that
// can follow it: upright edges pull along x, level ones along y. Everything is in pixels of one raster over the
// artwork, y down. Pure function; thread-safe.
#pragma once

#include <span>
#include <vector>

#include "planner/layout/bezier_fit.h"
#include "planner/layout/grid.h"
#include "planner/morph/edge_image.h"

namespace veneer::planner {

struct SpringGrid {
  GridSize size;
  std::vector<PlanePoint> vertices;  // row by row, (rows + 1) x (columns + 1)

  const PlanePoint& at(int row, int column) const {
    return vertices[static_cast<std::size_t>(row * (size.columns + 1) + column)];
  }
};

// A vertex that stays where it is put.
struct PlanePin {
  int row = 0, column = 0;
  PlanePoint at;
};

// The grid in equilibrium. Corners stay, vertices of the artwork's border slide along it, none goes farther than
// kFarthest of the spacing, and no border between two leans by more than 1 in 2. Without edges all stay to the last
// bit; an empty edge image has none. `pins` are vertices of the grid and themselves keep to all that.
inline constexpr double kFarthest = 0.4, kMostLean = 0.5;
SpringGrid spring_grid(const GridSize& size, double width, double height, const EdgeImage& edges,
                       std::span<const PlanePin> pins = {});

}  // namespace veneer::planner
