#include "calib/camera_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "calib/camera_bundle.h"
#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

constexpr double kCornerNoisePx = 0.1;
// Where the middle of the picture is put on the bed until the burnt pattern says better.
constexpr double kMiddleX = 260, kMiddleY = 190;

BundleSheet sheet_of(const GridView& view, const AprilGrid& grid) {
  BundleSheet sheet;
  sheet.height = view.height.count();
  for (const auto& tag : view.tags) {
    if (!grid.has(tag.id)) continue;
    const auto nominal = grid.corners(tag.id);
    for (std::size_t i = 0; i < 4; ++i) {
      sheet.corners.push_back(
          {{nominal[i].x.count(), nominal[i].y.count()}, {tag.corners[i].x.count(), tag.corners[i].y.count()}});
    }
  }
  return sheet;
}

// Every eighth corner: enough to find the way, fast enough to try several starts.
BundleState thinned(const BundleState& state) {
  BundleState thin = state;
  for (auto& sheet : thin.sheets) {
    std::vector<BundleCorner> few;
    for (std::size_t i = 0; i < sheet.corners.size(); i += 8) few.push_back(sheet.corners[i]);
    sheet.corners = std::move(few);
  }
  return thin;
}

// Where a lens of this focal length must hang to see the first sheet as it is seen: two poses fit a plane.
std::vector<CameraParameters> poses_for(double focal, const BundleSheet& sheet, const CameraParameters& size) {
  CameraParameters start = size;
  start.fx = start.fy = focal;
  start.cx = size.width_px / 2.0, start.cy = size.height_px / 2.0;
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;  // relative to the principal point, so the pixel convention does not enter
  for (const auto& corner : sheet.corners) {
    object.emplace_back(corner.sheet.x(), corner.sheet.y(), 0);
    image.emplace_back((corner.seen.x() - start.cx) / focal, (corner.seen.y() - start.cy) / focal);
  }
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(object, image, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations, translations, false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};
  }
  std::vector<CameraParameters> out;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    cv::Mat rotation;
    cv::Rodrigues(rotations[i], rotation);
    const cv::Vec3d r(rotations[i].ptr<double>());
    cv::Vec3d t(translations[i].ptr<double>());
    // The sheet's face is the plane z = height of the bed.
    for (int k = 0; k < 3; ++k) t[k] -= rotation.at<double>(k, 2) * sheet.height;
    CameraParameters pose = start;
    pose.camera_from_bed_rotation = {r[0], r[1], r[2]};
    pose.camera_from_bed_translation = {t[0], t[1], t[2]};
    if (rotation.at<double>(2, 2) < 0) out.push_back(pose);  // it looks down on the printed face
  }
  return out;
}

// All views lie in parallel planes, from which no closed form gives the focal length: several starts, the best stays.
bool find_start(BundleState& state) {
  double best = std::numeric_limits<double>::infinity();
  BundleState best_state;
  for (const double focal : {0.6, 0.9, 1.4, 2.2}) {
    for (const auto& pose : poses_for(focal * state.camera.width_px, state.sheets[0], state.camera)) {
      BundleState trial = thinned(state);
      trial.camera = pose;
      for (std::size_t s = 1; s < trial.sheets.size(); ++s) place_sheet(CameraModel(pose), trial.sheets[s]);
      const double cost = solve_bundle(trial, 1.0, 40).cost;
      if (cost < best) best = cost, best_state = std::move(trial);
    }
  }
  if (!std::isfinite(best)) return false;
  state.camera = best_state.camera;
  for (std::size_t s = 0; s < state.sheets.size(); ++s) state.sheets[s].place = best_state.sheets[s].place;
  return true;
}

struct SheetError {
  double sum_mm2 = 0, max_mm = 0;
  std::size_t corners = 0;
};

SheetError error_of(const CameraModel& camera, const BundleSheet& sheet) {
  SheetError error;
  for (const auto& corner : sheet.corners) {
    const auto seen =
        camera.bed_from_camera(point<CameraFrame>(corner.seen.x(), corner.seen.y()), Millimetres(sheet.height));
    const Eigen::Vector2d bed = sheet.on_bed(corner.sheet);
    const double d = std::hypot(seen.x.count() - bed.x(), seen.y.count() - bed.y());
    error.sum_mm2 += d * d, error.max_mm = std::max(error.max_mm, d), ++error.corners;
  }
  return error;
}

// Corners far off the rest (a shadow, a reflection) go; returns how many.
int drop_outliers(BundleState& state, double rms_px) {
  const CameraModel camera(state.camera);
  const double limit = std::max(5 * rms_px, 0.5);
  int dropped = 0;
  for (auto& sheet : state.sheets) {
    dropped += static_cast<int>(std::erase_if(sheet.corners, [&](const BundleCorner& corner) {
      const Eigen::Vector2d bed = sheet.on_bed(corner.sheet);
      const auto p = camera.camera_from_bed(point<BedFrame>(bed.x(), bed.y()), Millimetres(sheet.height));
      return std::hypot(p.x.count() - corner.seen.x(), p.y.count() - corner.seen.y()) > limit;
    }));
  }
  return dropped;
}

double height_range(const std::vector<BundleSheet>& sheets) {
  const auto [low, high] = std::minmax_element(sheets.begin(), sheets.end(),
                                               [](const auto& a, const auto& b) { return a.height < b.height; });
  return high->height - low->height;
}

// Each view predicted by the others; views without which the heights would say nothing are not asked.
Millimetres leave_out(const BundleState& state, double min_height_range) {
  SheetError all;
  for (std::size_t out = 0; out < state.sheets.size(); ++out) {
    BundleState rest = state;
    BundleSheet asked = rest.sheets[out];
    rest.sheets.erase(rest.sheets.begin() + static_cast<std::ptrdiff_t>(out));
    if (height_range(rest.sheets) < min_height_range) continue;
    solve_bundle(rest, kCornerNoisePx, 12);
    const CameraModel camera(rest.camera);
    place_sheet(camera, asked);
    const SheetError error = error_of(camera, asked);
    all.sum_mm2 += error.sum_mm2, all.corners += error.corners;
  }
  return Millimetres(all.corners == 0 ? 0 : std::sqrt(all.sum_mm2 / static_cast<double>(all.corners)));
}

// Middle of the picture to (260, 190), the picture's +x to the bed's.
Isometry2<BedFrame, BedFrame> provisional_frame(const CameraModel& camera) {
  const auto& c = camera.parameters();
  const auto middle = camera.bed_from_camera(point<CameraFrame>(c.width_px / 2.0, c.height_px / 2.0), Millimetres(0));
  const auto right =
      camera.bed_from_camera(point<CameraFrame>(c.width_px / 2.0 + 100, c.height_px / 2.0), Millimetres(0));
  const double angle = -std::atan2((right.y - middle.y).count(), (right.x - middle.x).count());
  const Isometry2<BedFrame, BedFrame> turn(Radians(angle), {});
  const auto turned = turn * middle;
  return {Radians(angle), point<BedFrame>(kMiddleX - turned.x.count(), kMiddleY - turned.y.count())};
}

// A lattice over the bed, in the provisional frame.
std::vector<Point<BedFrame>> bed_lattice() {
  std::vector<Point<BedFrame>> places;
  for (int row = 0; row <= 6; ++row)
    for (int column = 0; column <= 8; ++column)
      places.push_back(point<BedFrame>(kMiddleX * column / 4, kMiddleY * row / 3));
  return places;
}

// How the camera's unknowns move what it says of a place on the bed: 2 x 15, mm per unknown.
Eigen::MatrixXd place_jacobian(const CameraModel& camera, const Point<BedFrame>& place, Millimetres height) {
  const auto pixels_by_unknown = camera_jacobian(camera.parameters(), place, height);
  const Millimetres step(0.5);
  const auto here = camera.camera_from_bed(place, height);
  const auto right = camera.camera_from_bed({place.x + step, place.y}, height);
  const auto away = camera.camera_from_bed({place.x, place.y + step}, height);
  Eigen::Matrix2d pixels_by_place;
  pixels_by_place << (right.x - here.x).count(), (away.x - here.x).count(), (right.y - here.y).count(),
      (away.y - here.y).count();
  pixels_by_place /= step.count();
  return -(pixels_by_place.inverse() * pixels_by_unknown);
}

// The worst place's uncertainty over the bed, from the fit's information matrix, the free isometry taken out.
Millimetres predicted_sigma(const CameraModel& camera, const Eigen::MatrixXd& information, double noise_scale,
                            const Isometry2<BedFrame, BedFrame>& provisional) {
  const Eigen::MatrixXd covariance =
      information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())) * noise_scale;
  const auto fit_from_provisional = provisional.inverse();
  const auto places = bed_lattice();
  double worst = 0;
  for (const double height : {0.0, 12.0}) {
    const auto rows = static_cast<Eigen::Index>(2 * places.size());
    Eigen::MatrixXd jacobian(rows, kCameraUnknowns), gauge(rows, 3);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto at = fit_from_provisional * places[i];
      const auto row = static_cast<Eigen::Index>(2 * i);
      jacobian.middleRows<2>(row) = place_jacobian(camera, at, Millimetres(height));
      gauge.middleRows<2>(row) << 1, 0, -at.y.count(), 0, 1, at.x.count();
    }
    const Eigen::MatrixXd inside = (gauge.transpose() * gauge).ldlt().solve(gauge.transpose() * jacobian);
    const Eigen::MatrixXd free_jacobian = jacobian - gauge * inside;
    const Eigen::MatrixXd spread =
        free_jacobian * covariance.topLeftCorner<kCameraUnknowns, kCameraUnknowns>() * free_jacobian.transpose();
    for (Eigen::Index r = 0; r < rows; r += 2) worst = std::max(worst, spread(r, r) + spread(r + 1, r + 1));
  }
  return Millimetres(std::sqrt(std::max(0.0, worst)));
}

Status enough_views(std::span<const GridView> views, const std::vector<BundleSheet>& sheets,
                    const CameraFitLimits& limits) {
  if (static_cast<int>(views.size()) < limits.min_views) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the camera's calibration needs {} pictures of the AprilGrid sheet, there are {}: lay the "
                             "sheet at other places of the bed and take more",
                             limits.min_views, views.size())};
  }
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const auto tags = sheets[i].corners.size() / 4;
    if (tags >= static_cast<std::size_t>(limits.min_tags_per_view)) continue;
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("picture {} of the AprilGrid sheet shows {} of its tags, {} are needed: lay the sheet face "
                    "up where the camera sees it, light it evenly and take the picture again",
                    i + 1, tags, limits.min_tags_per_view)};
  }
  if (height_range(sheets) < limits.min_height_range.count()) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("all pictures of the AprilGrid sheet show it at nearly one height: take at least one with "
                             "the sheet raised on blocks by {:.0f} mm or more",
                             limits.min_height_range.count())};
  }
  return Ok();
}

}  // namespace

GridView grid_view(const cv::Mat& picture, Millimetres height, const AprilGrid& grid) {
  GridView view{height, detect_tags<CameraFrame>(picture)};
  std::erase_if(view.tags, [&](const auto& tag) { return !grid.has(tag.id); });
  return view;
}

Result<CameraFit> fit_camera_model(std::span<const GridView> views, int width_px, int height_px, const AprilGrid& grid,
                                   const CameraFitLimits& limits) {
  BundleState state;
  state.camera.width_px = width_px, state.camera.height_px = height_px;
  for (const GridView& view : views) state.sheets.push_back(sheet_of(view, grid));
  if (const Status enough = enough_views(views, state.sheets, limits); !enough.ok()) return enough.error();
  if (!find_start(state)) {
    return Error{ErrorCode::kRefused,
                 "the pictures of the AprilGrid sheet fit no camera that looks down on the bed: check that the sheet "
                 "lies flat and is the one that was printed for this cell"};
  }

  BundleOutcome outcome = solve_bundle(state, 1.0, 60);
  CameraFit fit;
  fit.dropped = drop_outliers(state, outcome.rms_px);
  outcome = solve_bundle(state, kCornerNoisePx, 60);

  const CameraModel fitted(state.camera);
  SheetError all;
  for (const auto& sheet : state.sheets) {
    const SheetError error = error_of(fitted, sheet);
    all.sum_mm2 += error.sum_mm2, all.corners += error.corners;
    all.max_mm = std::max(all.max_mm, error.max_mm);
  }
  fit.rms_px = outcome.rms_px;
  fit.rms = Millimetres(std::sqrt(all.sum_mm2 / static_cast<double>(all.corners)));
  fit.max = Millimetres(all.max_mm);
  fit.views = static_cast<int>(views.size());
  fit.corners = static_cast<int>(all.corners);
  if (fit.rms_px > limits.max_rms_px) {
    return Error{
        ErrorCode::kRefused,
        fmt::format(
            "the fitted camera misses the AprilGrid sheet's corners by {:.2f} px ({:.3f} mm) rms; at most {:.2f} px "
            "is allowed: check the heights entered, that the sheet lay flat and still, and repeat",
            fit.rms_px, fit.rms.count(), limits.max_rms_px)};
  }
  fit.leave_out_rms = leave_out(state, limits.min_height_range.count());
  if (fit.leave_out_rms > limits.max_leave_out_rms) {
    return Error{
        ErrorCode::kRefused,
        fmt::format(
            "a picture of the AprilGrid sheet contradicts the others by {:.3f} mm; at most {:.3f} mm is allowed: "
            "lay the sheet at places all over the whole bed, check the heights entered, and repeat",
            fit.leave_out_rms.count(), limits.max_leave_out_rms.count())};
  }
  const auto provisional = provisional_frame(fitted);
  const double noise_scale = std::pow(fit.rms_px / std::sqrt(2.0) / kCornerNoisePx, 2);
  fit.predicted_sigma = predicted_sigma(fitted, outcome.information, noise_scale, provisional);
  fit.model = fitted.re_anchored(provisional);
  return fit;
}

}  // namespace veneer::calib
