// Pictures at the working resolution. The only place where the planner changes a picture's resolution.
//
// Shrinking averages over areas, enlarging interpolates linearly; the scale is exact (OpenCV's resize rounds the size
// and then stretches to it), because half a pixel at the far end of a panel is wood cut in the wrong place.
// kCancelled: within a row after a stop was requested.
#pragma once

#include <opencv2/core/mat.hpp>
#include <stop_token>

#include "base/raster.h"
#include "base/result.h"

namespace veneer::planner {

// One axis: out pixel i averages source [offset + i * step, offset + (i + 1) * step).
struct AxisScale {
  int size = 0;       // pixels out
  double step = 1;    // source pixels per pixel out
  double offset = 0;  // source pixels before the first
};

// Keeps CV_8U depth and the number of channels.
Result<cv::Mat> resample(const cv::Mat& source, const AxisScale& columns, const AxisScale& rows,
                         const std::stop_token& stop);

// The whole picture stretched to the given size.
Result<cv::Mat> stretch(const cv::Mat& source, int width, int height, const std::stop_token& stop);
cv::Mat stretch(const cv::Mat& source, int width, int height);

// Keeps the lower left corner and the exact scale; what is less than a pixel at the right and upper border is dropped.
template <class Frame>
Result<Raster<Frame>> at_resolution(const Raster<Frame>& raster, ScanResolution resolution,
                                    const std::stop_token& stop);
template <class Frame>
Raster<Frame> at_resolution(const Raster<Frame>& raster, ScanResolution resolution) {
  return *at_resolution(raster, resolution, std::stop_token());
}

extern template Result<Raster<PanelFrame>> at_resolution(const Raster<PanelFrame>&, ScanResolution,
                                                         const std::stop_token&);

}  // namespace veneer::planner
