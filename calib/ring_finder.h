// Finds thin dark circles of known diameter on a pale surface of the bed. Private to calib.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/camera_model.h"

namespace veneer::calib {

struct Circle {
  Point<BedFrame> centre;
  Millimetres diameter{0};
  Millimetres scatter{0};  // rms of the line's radius about the circle
  double seen = 0;         // fraction of the directions in which the line was found
};

// Places where a circle of this diameter may be, anywhere in `area`, the likeliest first; many are false. No more than
// four for each of the `expected` circles, or 500 where that is more.
std::vector<Point<BedFrame>> propose_circles(const cv::Mat& grey, const CameraModel& model, Millimetres height,
                                             const Box<BedFrame>& area, Millimetres diameter, std::size_t expected);

// Fits the circle near `guess` on the picture itself (no resampling); seen = 0 when there is none.
Circle refine_circle(const cv::Mat& grey, const CameraModel& model, Millimetres height, Point<BedFrame> guess,
                     Millimetres diameter);

}  // namespace veneer::calib
