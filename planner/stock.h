// The wood a plan may use.
#pragma once

#include "base/ids.h"
#include "base/raster.h"

namespace veneer::planner {

// One panel, seen from its show face. The two rasters may differ in resolution and extent; both lie in PanelFrame.
struct StockPanel {
  PanelId id;
  Raster<PanelFrame> picture;  // CV_8UC3, BGR
  // CV_8UC1. Non-zero: the whole square of this pixel is usable wood that nobody holds (veneer mask minus live
  // allocations, already grown by kerf and position margin). Wood outside the raster is not free. A mask made by
  // testing pixel centres against polygons is up to 0.71 pixel too generous: shrink it, or plan with a position margin.
  Raster<PanelFrame> free;
};

}  // namespace veneer::planner
