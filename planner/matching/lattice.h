// The candidate places of one panel at one rotation: a square lattice of working pixels, turned against the panel's.
//
// Lattice pixels (column X, row Y, y down) are where a turned copy of the panel would have its pixels. A window of the
// artwork laid with its upper left pixel on (X, Y) samples the panel exactly at lattice pixels, so that all windows of
// one rotation share one set of samples. Continuous coordinates put pixel centres at +0.5.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/frames.h"
#include "base/raster.h"

namespace veneer::planner {

class Lattice {
 public:
  // Covers a panel raster of columns x rows working pixels. `turn` is that of panel_from_artwork, counter-clockwise.
  Lattice(int panel_columns, int panel_rows, Radians turn);

  int width() const { return width_; }
  int height() const { return height_; }
  Radians turn() const { return turn_; }

  // Continuous lattice coordinates -> continuous panel pixels, and back.
  void to_panel(double x, double y, double& column, double& row) const {
    const double u = x + x0_, v = y + y0_;
    column = cos_ * u + sin_ * v;
    row = cos_ * v - sin_ * u;
  }
  void from_panel(double column, double row, double& x, double& y) const {
    x = cos_ * column - sin_ * row - x0_;
    y = sin_ * column + cos_ * row - y0_;
  }
  double cos() const { return cos_; }
  double sin() const { return sin_; }

 private:
  Radians turn_;
  double cos_, sin_;
  int x0_ = 0, y0_ = 0;  // of the lattice's upper left corner in turned panel coordinates
  int width_ = 0, height_ = 0;
};

// An interval of x along a lattice row; empty when high < low.
struct RowStretch {
  double low, high;

  // Cuts it down to where a point that moves along with x lies on a panel of columns x rows pixels. The point is given
  // by its panel pixels at x = 0. A row that runs along the border, beyond it by up to `tolerance`, still lies on it.
  void keep_on_panel(const Lattice& lattice, double column, double row, double columns, double rows,
                     double tolerance = 0) {
    // Along the row the panel's coordinates run as column + cos * x and row - sin * x.
    clip(column, lattice.cos(), columns, tolerance);
    clip(row, -lattice.sin(), rows, tolerance);
  }

 private:
  void clip(double start, double slope, double limit, double tolerance) {
    if (std::abs(slope) < 1e-12) {
      if (start < -tolerance || start > limit + tolerance) high = low - 1;
      return;
    }
    const double a = -start / slope, b = (limit - start) / slope;
    low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
  }
};

// Working pixels of an artwork: `height` is the artwork's, rows count from its upper border.
struct PixelGrid {
  ScanResolution resolution;
  Millimetres height;
};

// Working pixels along a side of an artwork: all of them have their centre inside it.
int working_pixels(Millimetres side, ScanResolution resolution);

// Where a window lands whose upper left pixel is (left, top) of the artwork and lies on lattice pixel (x, y).
Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork(const Lattice& lattice, const Raster<PanelFrame>& panel,
                                                       const PixelGrid& artwork, int left, int top, int x, int y);

}  // namespace veneer::planner
