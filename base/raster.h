// A picture lying in a millimetre frame. cv::Mat is the only OpenCV name in base.
//
// Pixel (column c, row r) has its centre at (c + 0.5, r + 0.5) in pixels with y down. The raster's lower left corner is
// the frame's point `origin`, so that centre lies at
//   x = origin.x + (c + 0.5) / px_per_mm,   y = origin.y + (rows - (r + 0.5)) / px_per_mm.
// Copies share pixels (cv::Mat); treat a Raster as immutable once made.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/geometry.h"

namespace veneer {

template <class Frame>
struct Raster {
  cv::Mat pixels;  // CV_8UC3 (BGR), CV_8UC1 masks and greys, CV_32FC1 maps
  ScanResolution resolution;
  Point<Frame> origin{};

  Millimetres width() const { return resolution.to_mm(Pixels(pixels.cols)); }
  Millimetres height() const { return resolution.to_mm(Pixels(pixels.rows)); }
  // Continuous pixel coordinates (centres at +0.5, y down) of a point of the frame.
  void to_pixels(const Point<Frame>& p, double& column, double& row) const {
    column = resolution.to_px(p.x - origin.x).count();
    row = pixels.rows - resolution.to_px(p.y - origin.y).count();
  }
  Point<Frame> from_pixels(double column, double row) const {
    return {origin.x + resolution.to_mm(Pixels(column)), origin.y + resolution.to_mm(Pixels(pixels.rows - row))};
  }
};

}  // namespace veneer
