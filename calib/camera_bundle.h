// The bundle adjustment behind camera_fit: all corners of all views against one camera. Private to calib.
//
// Unknowns, in this order: fx fy cx cy k1 k2 p1 p2 k3, rotation (3), translation (3), then x, y, angle of each sheet
// but the first, whose place defines the bed frame while the fit runs.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/april_grid.h"
#include "calib/camera_model.h"

namespace veneer::calib {

inline constexpr int kCameraUnknowns = 15;
inline constexpr int kSheetUnknowns = 3;

struct BundleCorner {
  Eigen::Vector2d sheet;  // mm
  Eigen::Vector2d seen;   // px
};

struct BundleSheet {
  double height = 0;                                // mm above the bed
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // bed_from_sheet: x, y, angle
  std::vector<BundleCorner> corners;

  Eigen::Vector2d on_bed(const Eigen::Vector2d& sheet) const;
};

struct BundleState {
  CameraParameters camera;
  std::vector<BundleSheet> sheets;
};

struct BundleOutcome {
  double cost = 0;              // sum of squares of corners and priors, in units of the corner noise
  double rms_px = 0;            // of the corners
  Eigen::MatrixXd information;  // JtJ at the end, noise units
};

// Levenberg-Marquardt from `state`, which is moved to the best found. `noise_px` weighs corners against the weak priors
// that keep what the pictures do not show (lens terms beyond the corners seen) at physical values.
BundleOutcome solve_bundle(BundleState& state, double noise_px, int max_steps);

// The Jacobian of one place's picture by the camera's unknowns: px per unknown.
Eigen::Matrix<double, 2, kCameraUnknowns> camera_jacobian(const CameraParameters& camera, const Point<BedFrame>& place,
                                                          Millimetres height);

// Moves one sheet in its plane to fit its corners, the camera held.
void place_sheet(const CameraModel& camera, BundleSheet& sheet);

}  // namespace veneer::calib
