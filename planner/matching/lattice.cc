#include "planner/matching/lattice.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {

Lattice::Lattice(int panel_columns, int panel_rows, Radians turn)
    : turn_(turn), cos_(std::cos(turn.count())), sin_(std::sin(turn.count())) {
  double left = 0, top = 0, right = 0, bottom = 0;
  for (const double column : {0.0, static_cast<double>(panel_columns)}) {
    for (const double row : {0.0, static_cast<double>(panel_rows)}) {
      double x = 0, y = 0;
      from_panel(column, row, x, y);
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  }
  constexpr double kRounding = 1e-9;
  x0_ = static_cast<int>(std::floor(left + kRounding));
  y0_ = static_cast<int>(std::floor(top + kRounding));
  width_ = static_cast<int>(std::ceil(right - kRounding)) - x0_;
  height_ = static_cast<int>(std::ceil(bottom - kRounding)) - y0_;
}

int working_pixels(Millimetres side, ScanResolution resolution) {
  constexpr double kRounding = 1e-6;  // a centre on the border is outside
  return std::max(1, static_cast<int>(std::floor(resolution.to_px(side).count() + 0.5 - kRounding)));
}

Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork(const Lattice& lattice, const Raster<PanelFrame>& panel,
                                                       const PixelGrid& artwork, int left, int top, int x, int y) {
  double column = 0, row = 0;
  lattice.to_panel(x - left, y - top, column, row);  // the artwork's upper left corner
  const Point<PanelFrame> corner = panel.from_pixels(column, row);
  const Isometry2<PanelFrame, ArtworkFrame> turned(lattice.turn(), {});
  const Point<PanelFrame> moved = turned * Point<ArtworkFrame>{Millimetres(0), artwork.height};
  return {lattice.turn(), {corner.x - moved.x, corner.y - moved.y}};
}

}  // namespace veneer::planner
