// What tells wood from board and lid: its warmth, log(red / blue), against that of the map's own board and lid.
// Shared by mask and reconciliation. Internal; thread-safe.
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

struct WoodColour {
  double ratio = 1;  // red over blue, above which a pixel is wood
  double white = 255;

  // The board is learnt from the neutral part of the map's margin, the lid from what is brightest.
  static WoodColour learn(const WorkMap& work, const cv::Mat& fiducials);
  bool is_lid(const cv::Vec3b& bgr) const;   // fully lit
  bool is_wood(const cv::Vec3b& bgr) const;  // warm, and not the lid
  cv::Mat wood(const cv::Mat& bgr) const;    // 255 where is_wood
  cv::Mat lid(const cv::Mat& bgr) const;     // 255 where is_lid
};

cv::Mat round_kernel(double radius_px);

}  // namespace veneer::calib
