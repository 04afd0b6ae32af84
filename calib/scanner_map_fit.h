// What the fit of a scanner's map and the prediction of its error share. Private to calib.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "calib/scanner_model.h"

namespace veneer::calib {

// A corner of the AprilGrid sheet as one scan shows it.
struct GridCorner {
  std::size_t scan = 0, tag = 0;  // tag: index over all scans
  double x = 0, y = 0;            // nominal mm, y down
  Point<SheetFrame> on_sheet;
  bool inner = false;  // its tag has neighbours all around
  bool dropped = false;
  int fold = 0;
};

struct ShiftLattice {
  int columns = 0, rows = 0;
  double sx = 0, sy = 0;
  int size() const { return columns * rows; }
};

using GlassFromSheet = Isometry2<GlassFrame, SheetFrame>;

// Unknowns: the splines' coefficients for x, for y, then turn and way in x and y of each scan's sheet.
struct MapFit {
  Eigen::VectorXd shift_x, shift_y;
  std::vector<GlassFromSheet> poses;
  ScannerModel model;
  // Of the least squares at the solution, a corner's noise counting 1: its inverse times the noise's variance is the
  // covariance of the unknowns, what the smoothness expected of a scanner leaves open with it.
  Eigen::MatrixXd normal;
};

// Which coefficients act at a place, by how much.
struct Bent {
  std::array<int, 16> index{};
  std::array<double, 16> weight{};
};
Bent basis_at(const ShiftLattice& lattice, double x, double y);

// One coordinate (0: x, 1: y) of a corner as the map has it, less the sheet's: what an unknown changes of it.
struct ResidualRow {
  std::array<int, 18> index{};
  std::array<double, 18> value{};
};
ResidualRow residual_row(const ShiftLattice& lattice, const Bent& bent, std::size_t scan, const GlassFromSheet& pose,
                         const Point<GlassFrame>& placed, int axis);

// Distance between a corner as the map has it and as the sheet does, mm.
double corner_miss(const MapFit& fit, const GridCorner& corner);

}  // namespace veneer::calib
