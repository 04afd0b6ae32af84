// A panel's wood as pictures: what is free of it, for the planner and for people. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/raster.h"
#include "db/ledger.h"

namespace veneer::daemon {

// Of the mask: non-zero = usable.
SquareMillimetres wood_area(const Raster<PanelFrame>& mask);

// Mask minus what live allocations take, grown by `margin`; never too generous: a pixel that one touches is not free.
Raster<PanelFrame> free_wood(const Raster<PanelFrame>& mask, const std::vector<Region<PanelFrame>>& live,
                             Millimetres margin);

// Calls the regions wood too, 255 in the mask.
void add_wood(Raster<PanelFrame>& mask, const std::vector<Region<PanelFrame>>& regions);

// What of `free` lies in one of the wanted regions and in none of the others; never too generous.
Raster<PanelFrame> wood_within(const Raster<PanelFrame>& free, const std::vector<Region<PanelFrame>>& wanted,
                               const std::vector<Region<PanelFrame>>& others);

// The veneer map as an operator wants to see it: what is free in its own colours, reserved, cut and suspect wood
// marked, with a legend below. `mask`: of the map's size, 128 and more = usable.
cv::Mat draw_stock(const Raster<PanelFrame>& map, const cv::Mat& mask, const std::vector<db::AllocationRecord>& live);

// A scan as somebody is to judge it: usable wood in its own colours within a line, the rest pale. With the mask that
// counts until now, what it would take away is red and what it would give back green. All of one size.
cv::Mat draw_proposal(const cv::Mat& map, const cv::Mat& mask, const cv::Mat& before);

}  // namespace veneer::daemon
