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
#include <span>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/april_grid.h"
#include "calib/tag_detector.h"

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
  // How much bed one pixel covers at this place, mm (mean of both directions).
  Millimetres pixel_size(Point<BedFrame> place, Millimetres height) const;
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

// One picture of the AprilGrid sheet lying flat on the bed, its printed face `height` above it.
struct GridView {
  Millimetres height{0};
  std::vector<Tag<CameraFrame>> tags;
};
GridView grid_view(const cv::Mat& picture, Millimetres height, const AprilGrid& grid = {});

struct CameraFit {
  CameraModel model;  // the bed's origin is provisional: the middle of the picture lies at (260, 190), +x right
  double rms_px = 0;  // of all used corners
  Millimetres rms{0}, max{0};  // the same on the sheets
  // Each view predicted by a camera fitted without it; only the sheet's place in the plane is free.
  Millimetres leave_out_rms{0};
  // What the corner noise leaves uncertain (one sigma, after the best isometry): the worst place of the picture's
  // part that lies within 260 x 190 mm around the middle, at heights 0 to 12 mm.
  Millimetres predicted_sigma{0};
  int views = 0, corners = 0, dropped = 0;
};

struct CameraFitLimits {
  int min_views = 4;
  int min_tags_per_view = 20;
  double max_rms_px = 0.35;
  Millimetres max_leave_out_rms{0.08};
  Millimetres min_height_range{5};  // between the lowest and the highest view
};

// One lens and one place of the camera for all views (a joint fit; each sheet's place in its plane is free, heights are
// as given). kInvalidArgument when there is too little to fit, kRefused when the residual is over the limits.
Result<CameraFit> fit_camera_model(std::span<const GridView> views, int width_px, int height_px,
                                   const AprilGrid& grid = {}, const CameraFitLimits& limits = {});

}  // namespace veneer::calib
