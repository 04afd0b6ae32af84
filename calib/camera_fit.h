// Calibrates the bed camera from pictures of the AprilGrid sheet lying in several places and at two heights or more.
//
// Bundle adjustment: all views share one lens and one place of the camera, and each sheet is free only in its plane.
// That is what makes the result metric on the bed: the sheet gives the millimetres, its known heights give the
// perspective.
// Functions are pure and may run at the same time.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "base/result.h"
#include "calib/april_grid.h"
#include "calib/camera_model.h"
#include "calib/tag_detector.h"

namespace veneer::calib {

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

// One lens and one place of the camera for all views; heights are as given. kInvalidArgument when there is too little
// to fit, kRefused when the residual is over the limits.
Result<CameraFit> fit_camera_model(std::span<const GridView> views, int width_px, int height_px,
                                   const AprilGrid& grid = {}, const CameraFitLimits& limits = {});

}  // namespace veneer::calib
