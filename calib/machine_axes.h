// What the laser's axes really do: machine_from_bed, an affine map (axis scale and skew), from a burnt pattern.
//
// The board that the pattern was burnt into may be bowed by some tenths of a millimetre, and then its rings are seen
// elsewhere: 0.2 mm shift them by up to 0.05 mm under a camera 500 mm up. The bow, a parabola along either side, is
// fitted with the axes; how high the board lies in all follows from its lying on the bed. A twist is not seen.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/burnt_pattern.h"
#include "calib/camera_model.h"
#include "calib/error_lattice.h"

namespace veneer::calib {

// How far off the axes are expected to be: the sum of a square that is the same everywhere and of one that grows with
// the distance from the rings. Rings of one column err alike along x, as their belt is off, and rings of one row along
// y: so whole columns and rows are left out at a time, and more rings in them make nothing smaller.
struct AxesError {
  Millimetres everywhere{0};  // rings predicted without their column or their row, whichever is worse, and the camera
  Eigen::Matrix3d open = Eigen::Matrix3d::Zero();  // mm2: h' open h at h = (x, y, 1), commanded mm
  std::vector<Point<MachineFrame>> measured;       // the rings; empty: nothing can be predicted
};

struct MachineAxes {
  // BedFrame shares origin and +x with MachineFrame, so the shift is zero and bed +x is commanded by +x alone.
  Affine2<MachineFrame, BedFrame> machine_from_bed;
  double scale_x = 1, scale_y = 1;  // true mm per commanded mm
  Radians skew{0};                  // how far the true angle between +x and +y is short of a right one
  CameraModel model;                // the camera over this BedFrame
  Millimetres rms{0}, max{0};       // what the affine leaves over, true mm
  Millimetres leave_out_rms{0};     // each ring predicted without it, by axes and a bow that were fitted without it
  Millimetres bow_x{0}, bow_y{0};   // of the board: its middle over its ends along either axis
  Millimetres bow_sigma{0};         // of the less certain of the two; which bows are held at 0: board_bow.h
  int rings = 0, dropped = 0;
  AxesError error;
};

struct MachineAxesLimits {
  int min_rings = 12;
  Millimetres max_rms{0.05};
  Millimetres max_single{0.20};
  Millimetres max_bow{1};         // of the board; what a higher one does to the rings is not known well enough
  double max_scale_error = 0.02;  // more than 2 % is a wrong $100/$101 setting, not wear
};

// `rings` were found with `provisional`, in a board whose upper face lies `height` above the bed where it touches it.
// `camera_off` is what the camera's certificate says of points its fit had not seen (left_out_rms_mm): a bow that
// shifts the rings by no more could be the lens's. 0 believes the camera, where that figure is not known.
// kRefused when the residual, the bow or the scale is over the limits.
Result<MachineAxes> fit_machine_axes(std::span<const FoundRing> rings, const CameraModel& provisional,
                                     Millimetres height, Millimetres camera_off = Millimetres(0),
                                     const MachineAxesLimits& limits = {});

// Over the places that the beam reaches, mm of BedFrame: the distance between where the laser burns and the place seen
// by the camera that it was sent to (calib/error_lattice.h). Nothing where three columns and rows of rings were not
// found.
std::optional<ErrorLattice> predict_axes_error(const MachineAxes& axes, const Box<MachineFrame>& reach);

}  // namespace veneer::calib
