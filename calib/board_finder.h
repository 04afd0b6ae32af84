// Where a bare board lies on the bed: an even area with straight edges, of the size that somebody told.
//
// A bare board has no tags, and neither its colour nor the bed's is known. So the picture is split at every threshold
// of brightness and of hue that might separate the two, and of each outline that comes of it only the size is compared.
// An outline that touches the border of the picture is ignored: the board may go on there, or it is everything in
// sight. Where none is found, the light may be at fault. Pure; thread-safe.
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
