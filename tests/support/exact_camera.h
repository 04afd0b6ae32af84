// The renderer's camera in calib's words, for tests of what comes after the camera's calibration.
#pragma once

#include <Eigen/Geometry>

#include "calib/camera_model.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {

inline CameraModel exact_model(const test::TrueCamera& camera) {
  CameraParameters p;
  p.width_px = camera.width, p.height_px = camera.height;
  p.fx = camera.focal, p.fy = camera.focal * camera.aspect, p.cx = camera.cx, p.cy = camera.cy;
  p.k1 = camera.lens[0], p.k2 = camera.lens[1], p.p1 = camera.lens[2], p.p2 = camera.lens[3], p.k3 = camera.lens[4];
  const auto axes = camera.axes();
  Eigen::Matrix3d rotation;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rotation(r, c) = axes[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  const Eigen::AngleAxisd turn(rotation);
  const Eigen::Vector3d w = turn.axis() * turn.angle();
  const Eigen::Vector3d t = -(rotation * Eigen::Vector3d(camera.eye_x, camera.eye_y, camera.eye_z));
  p.camera_from_bed_rotation = {w.x(), w.y(), w.z()};
  p.camera_from_bed_translation = {t.x(), t.y(), t.z()};
  return CameraModel(p);
}

}  // namespace veneer::calib
