// Which way the grain of wood runs, and which way a picture would like it to.
//
// A direction is the vector of twice its angle, from +x towards +y with y down, so that half turns fall together and
// directions can be averaged; its length, from 0 to 1, says how sure it is. Fields are coarse: CV_32FC2, a pixel a
// millimetre, from the upper left corner. Pure functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/units.h"

namespace veneer::planner {

// Along the lines of the wood: across the strongest change of tone over some 2 mm (structure tensor). `grey` is
// CV_32FC1 in [0, 1].
cv::Mat grain_of_wood(const cv::Mat& grey, ScanResolution resolution);

// Along the edges of the picture, and between them as the nearest and strongest say. The calmer a place the surer:
// where there is detail, wood is chosen for that. What is finer than `patch` is overlooked.
cv::Mat grain_of_picture(const cv::Mat& grey, ScanResolution resolution, Millimetres patch);

// Millimetres from the upper left corner; between pixels bilinear, beyond the border its value.
cv::Vec2f direction_at(const cv::Mat& field, double x_mm, double y_mm);

// The direction once what it belongs to is turned by an angle, counter-clockwise as people see it.
inline cv::Vec2f turned(const cv::Vec2f& direction, double cos, double sin) {
  // Twice the angle, and clockwise where y is down.
  const auto c = static_cast<float>(cos * cos - sin * sin), s = static_cast<float>(-2 * sin * cos);
  return {c * direction[0] - s * direction[1], s * direction[0] + c * direction[1]};
}

// In [0, 1]: 0 where both are parallel or one is wholly unsure, 1 where two sure ones cross at right angles.
inline double disagreement(const cv::Vec2f& a, const cv::Vec2f& b) {
  return 0.5 * (cv::norm(a) * cv::norm(b) - static_cast<double>(a.dot(b)));
}

}  // namespace veneer::planner
