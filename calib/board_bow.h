// How a board that is not flat lies on the bed, told by what was burnt into it: the machine's axes make an affine map
// of what was commanded, and a bow makes none. Internal to machine_axes. Thread-safe.
#pragma once

#include <span>

#include "base/frames.h"

namespace veneer::calib {

// A mark, and the ray that it is seen along: where that meets the plane at the height that was given, and one
// millimetre above it.
struct RayToMark {
  Point<MachineFrame> commanded;
  Point<BedFrame> at_height, above;
};

struct BoardBow {
  Point<MachineFrame> middle;
  Millimetres half_x{0}, half_y{0};  // half of the board
  double slope_x = 0, slope_y = 0;   // mm of lift at the board's end
  double bow_x = 0, bow_y = 0;       // mm, of the ends over the middle; negative where the middle stands up
  // One sigma of either bow, by the marks' scatter and the camera's error. A bow of 0 is one that these could feign.
  Millimetres sigma_x{0}, sigma_y{0};

  // By how much it lies higher there than a flat board would. It lies on the bed with its middle or with its ends.
  Millimetres lift(const Point<MachineFrame>& at) const;
};

// `camera_off`: how far off the camera's map may be, rms. An error of its lens grows with the distance from the middle
// as a bow's shift does, and no mark tells them apart.
BoardBow fit_board_bow(std::span<const RayToMark> marks, Millimetres camera_off);

}  // namespace veneer::calib
