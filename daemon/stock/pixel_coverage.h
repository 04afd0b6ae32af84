// How much of each pixel of a raster a region covers: the exact area, not samples of it.
//
// Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/polygon_ops.h"
#include "base/raster.h"

namespace veneer::daemon {

// `covered` is CV_64FC1, fractions of pixels, 0 to 1; its upper left pixel is (column, row) of the raster, which may
// lie outside of it. Empty for an empty region.
struct PixelCoverage {
  cv::Mat covered;
  int column = 0, row = 0;
};

PixelCoverage pixel_coverage(const Region<PanelFrame>& region, const Raster<PanelFrame>& raster);

}  // namespace veneer::daemon
