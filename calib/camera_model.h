// The bed camera: lens, and where it hangs over the bed. Ties pixels of a picture to true millimetres on the bed.
//
// A pixel and a height above the bed make a place: the camera sees rays, and 2.1 mm of material shifts what lies on it
// by more than 1 mm at the rim of the bed. So every crossing names the height of the surface that is looked at.
//
// CameraParameters are plain doubles for storage. Pixels count as everywhere (y down, centres at +0.5); OpenCV's own
// convention is met only inside camera_model.cc. Values; thread-safe as such.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "base/frames.h"

namespace veneer::calib {

struct CameraParameters {
  int width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;                // px
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;        // Brown-Conrady, as OpenCV orders and defines them
  std::array<double, 3> camera_from_bed_rotation{};     // axis times angle, rad
  std::array<double, 3> camera_from_bed_translation{};  // mm; bed: +x right, +y away, +z up, z = 0 on the bed
};

class CameraModel {
 public:
  CameraModel() = default;
  explicit CameraModel(const CameraParameters& parameters);

  // Where the ray through `seen` meets the plane `height` above the bed.
  Point<BedFrame> bed_from_camera(Point<CameraFrame> seen, Millimetres height) const;
  Point<CameraFrame> camera_from_bed(Point<BedFrame> place, Millimetres height) const;
  // The picture as seen straight from above at `height`: pixels of the given resolution over `area`.
  cv::Mat rectify(const cv::Mat& picture, const Box<BedFrame>& area, ScanResolution resolution,
                  Millimetres height) const;
  // The same camera over a bed frame that was turned and moved in its plane. Handedness of the map must be proper.
  CameraModel re_anchored(const Isometry2<BedFrame, BedFrame>& new_from_old) const;

  const CameraParameters& parameters() const { return parameters_; }

 private:
  CameraParameters parameters_;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace veneer::calib
