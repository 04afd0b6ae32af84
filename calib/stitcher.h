// Makes one veneer map out of tiles: resampled into PanelFrame, exposure compensated, seams feathered.
// Thread-safe; uses OpenCV's threads.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "base/raster.h"
#include "base/result.h"
#include "calib/registration.h"

namespace veneer::calib {

struct StitchTile {
  cv::Mat pixels;  // CV_8UC3, as scanned
  ScanMap panel_from_scan;
};

struct StitchOptions {
  ScanResolution resolution = ScanResolution::from_dpi(300);
  Millimetres feather{8};  // width of the blend at a seam
  bool compensate_exposure = true;
};

// The map covers `area` (rounded up to whole pixels at the top and the right; its lower left corner is exactly
// area.min). What no tile shows is white. kInvalidArgument when the tiles do not fit the picture type or the area is
// empty.
Result<Raster<PanelFrame>> stitch(std::span<const StitchTile> tiles, const Box<PanelFrame>& area,
                                  const StitchOptions& options = {});

}  // namespace veneer::calib
