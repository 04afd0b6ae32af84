// The direction field that a mosaic's tiles follow (Hausner 2001, section 4): across the nearest edge of the picture.
//
// Tiles look the same after a quarter turn, so a direction is known up to quarter turns. Pixels' middles lie at +0.5.
// Pure functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::planner {

// The edges of a picture (CV_8UC3, BGR) that matter to tiles of side `tile` pixels: CV_8UC1, 255 on lines one pixel
// wide. Found after Canny 1986, in the picture without what is finer than a tile; short ones are left out.
cv::Mat salient_edges(const cv::Mat& bgr, double tile);

struct DirectionField {
  cv::Mat distance;  // CV_32FC1: pixels to the nearest edge
  cv::Mat angle;     // CV_32FC1: radians, in (-pi/4, pi/4], of one axis of the tiles, from +x towards +y, y down
  // CV_32FC1: the same of the axis that lies across the nearest edge, in (-pi/2, pi/2]: long tiles lie along edges.
  cv::Mat across;
};

// The gradient of the distance to the nearest edge, or to the picture's border, which tiles follow too. `smoothing`,
// in pixels: where the nearest edge changes, the direction turns within about so much.
DirectionField direction_field(const cv::Mat& edges, double smoothing);

}  // namespace veneer::planner
