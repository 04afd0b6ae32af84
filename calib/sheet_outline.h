// The sheet's rectangle from the border between sheet and lid. Internal to registration.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "base/frames.h"
#include "calib/tile_join.h"

namespace veneer::calib {

// Points of the sheet's border in one scan, about a millimetre apart; where the sheet runs off the picture, the
// picture's rim. Empty when there is nothing but lid. A board as bright as the lid is told from it by its shadow; the
// tags say what must lie within.
std::vector<Point<ScanFrame>> find_outline(const cv::Mat& picture, ScanResolution nominal,
                                           const std::vector<Tag<ScanFrame>>& tags);

// Upright: `up` is a direction in JoinedFrame. Gives the frame whose origin is the rectangle's lower left corner, +x
// along its lower edge.
struct SheetRectangle {
  Isometry2<PanelFrame, JoinedFrame> panel_from_joined;
  Millimetres width{0}, height{0};
  double least_seen = 0;  // of the side that is seen least: the share of its length that has border points
};
SheetRectangle fit_rectangle(const std::vector<Point<JoinedFrame>>& border, double up_x, double up_y);

}  // namespace veneer::calib
