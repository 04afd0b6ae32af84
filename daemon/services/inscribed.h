// What fits into free wood: the largest square and circle, and where squares of one size lie. Pure; thread-safe.
//
// Rasters are masks, non-zero = free; a pixel is the square it is, and what lies beside the raster is not free.
#pragma once

#include <functional>
#include <optional>

#include "base/raster.h"

namespace veneer::daemon {

struct InscribedSquare {
  Point<PanelFrame> min;  // its lower left corner
  Millimetres side{0};
};

struct InscribedCircle {
  Point<PanelFrame> centre;
  Millimetres radius{0};
};

// The largest square of free pixels whose sides lie along the panel's; a turned one may be larger. Of several the
// uppermost, then the leftmost. Nothing when no pixel is free. Exact; rows times columns.
std::optional<InscribedSquare> largest_square(const Raster<PanelFrame>& free);

// The largest circle that no pixel reaches into which is not free, about a pixel's centre, a corner or the middle of an
// edge. Nothing when no pixel is free. Exact; 16 bytes of memory for each pixel.
std::optional<InscribedCircle> largest_circle(const Raster<PanelFrame>& free);

// The same wood in pixels `factor` times as large, of which one is free when all of it is: never too generous.
Raster<PanelFrame> in_larger_pixels(const Raster<PanelFrame>& free, int factor);

// All of the free wood that a free square with sides of `side`, along the panel's, can cover: the opening of
// mathematical morphology. A side is rounded up to whole pixels. `accepts`, when given, is handed the mask of all
// upper left pixels of such squares and strikes out those that are not wanted.
Raster<PanelFrame> covered_by_squares(const Raster<PanelFrame>& free, Millimetres side,
                                      const std::function<void(cv::Mat& corners, int side_px)>& accepts = {});

}  // namespace veneer::daemon
