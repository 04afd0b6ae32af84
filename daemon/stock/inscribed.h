// What fits into free wood: the largest square and circle, and what squares of each size cover. Pure; thread-safe.
//
// Rasters are masks, non-zero = free; a pixel is the square it is, and what lies beside the raster is not free.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

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

// A side as whole pixels: rounded up, one at least.
int whole_pixels(ScanResolution resolution, Millimetres side);

// How many pixels of the free wood squares of each side can cover: [n] is told of free squares of n + 1 pixels, sides
// along the panel's, up to the largest. What they cover is the opening of mathematical morphology; it never grows with
// the side. Exact. Three more bits of memory for each pixel, and some for each corner of the wood.
std::vector<std::int64_t> covered_by_squares(const Raster<PanelFrame>& free);

}  // namespace veneer::daemon
