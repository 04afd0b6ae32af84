// Where a bare board lies on the bed: an even area with straight edges, of the size that somebody told.
//
// A board has no tags, and no colour of its own, and how dark the bed is beside it nobody knows. So every level of
// light and every hue is tried that may part it from what it lies on, and its outline alone is held against the size.
// An outline that reaches the rim of what the camera sees is nobody's: the board may go on there, or be no board but
// all that is in sight. That none is found may be the light's fault. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/geometry.h"
#include "base/units.h"
#include "calib/camera_model.h"

namespace veneer::calib {

// As somebody measured it with a ruler.
struct WantedBoard {
  Millimetres width{0}, height{0};  // along the bed's x and y
  Millimetres upper_face{0};        // above the bed
};
// How far a side may be off: by the ruler, and by a camera that sees a millimetre of height as some of width.
Millimetres tolerance_of_side(Millimetres side);

struct FoundBoard {
  Point<BedFrame> centre;
  Millimetres width{0}, height{0};  // of the sides that lie nearest to the bed's x and y
  double turn_deg = 0;              // of the width against x, anticlockwise; at most 45 either way
};
// Is its width the wanted board's width, and its height that one's height?
bool lies_as_wanted(const FoundBoard& found, const WantedBoard& wanted);

// Boards of that size whichever way they lie, all of each in the picture (BGR, 8 bit, of the camera's size). Each is
// told once.
std::vector<FoundBoard> find_boards(const cv::Mat& picture, const CameraModel& camera, const WantedBoard& wanted);

}  // namespace veneer::calib
