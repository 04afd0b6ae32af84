// What the laser's axes really do: machine_from_bed, an affine map (axis scale and skew), from a burnt pattern.
//
// The board that the pattern was burnt into may be bowed by some tenths of a millimetre, which the camera sees as rings
// that lie elsewhere: by 0.1 mm at the rim of a bed under a camera 500 mm up. The bow is fitted with the axes; how high
// the board lies in all follows from its lying on the bed.
#pragma once

#include <span>

#include "base/frames.h"
#include "base/result.h"
#include "calib/burnt_pattern.h"
#include "calib/camera_model.h"

namespace veneer::calib {

struct MachineAxes {
  // BedFrame shares origin and +x with MachineFrame, so the shift is zero and bed +x is commanded by +x alone.
  Affine2<MachineFrame, BedFrame> machine_from_bed;
  double scale_x = 1, scale_y = 1;  // true mm per commanded mm
  Radians skew{0};                  // how far the true angle between +x and +y is short of a right one
  CameraModel model;                // the camera over this BedFrame
  Millimetres rms{0}, max{0};       // what the affine leaves over, true mm
  Millimetres leave_out_rms{0};     // each ring predicted without it
  Millimetres bow_x{0}, bow_y{0};   // of the board: its middle over its ends along either axis
  int rings = 0, dropped = 0;
};

struct MachineAxesLimits {
  int min_rings = 12;
  Millimetres max_rms{0.05};
  Millimetres max_single{0.20};
  double max_scale_error = 0.02;  // more than 2 % is a wrong $100/$101 setting, not wear
};

// `rings` were found with `provisional`, in a board whose upper face lies `height` above the bed where it touches it.
// kRefused when the residual or the scale is over the limits.
Result<MachineAxes> fit_machine_axes(std::span<const FoundRing> rings, const CameraModel& provisional,
                                     Millimetres height, const MachineAxesLimits& limits = {});

}  // namespace veneer::calib
