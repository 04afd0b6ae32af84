// A veneer map as mask and reconciliation work on it, coarser than it was stitched. Internal; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/raster.h"
#include "calib/fiducials.h"

namespace veneer::calib {

// A veneer map at about 6 px/mm, slightly smoothed: pixel (c, r) covers the map's pixels from (c * fold, r * fold).
// A map that does not divide is continued at its right and lower borders.
struct WorkMap {
  int fold = 1;
  double px_per_mm = 0;
  cv::Mat bgr;
};
WorkMap shrink(const Raster<PanelFrame>& map);

// 255 on the show face's tags, on through-holes, and within `margin` of them.
cv::Mat mark_fiducials(const Raster<PanelFrame>& map, const PanelFiducials& fiducials, const WorkMap& work,
                       Millimetres margin);

cv::Mat round_kernel(double radius_px);

}  // namespace veneer::calib
