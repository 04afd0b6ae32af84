#include "calib/camera_model.h"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace veneer::calib {
namespace {

// OpenCV counts a pixel's centre as 0, the project as +0.5. This is where the two meet.
constexpr float kOpenCvPixelShift = 0.5F;

Eigen::Matrix3d rotation_of(const std::array<double, 3>& axis_angle) {
  const Eigen::Vector3d v(axis_angle[0], axis_angle[1], axis_angle[2]);
  const double angle = v.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, v / angle).toRotationMatrix();
}

std::array<double, 3> axis_angle_of(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  const Eigen::Vector3d v = turn.axis() * turn.angle();
  return {v.x(), v.y(), v.z()};
}

// Lens: from the ray's slopes to the distorted slopes, with the Jacobian on demand (Brown-Conrady).
Eigen::Vector2d distort(const CameraParameters& c, const Eigen::Vector2d& u, Eigen::Matrix2d* jacobian = nullptr) {
  const double x = u.x(), y = u.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  if (jacobian != nullptr) {
    const double d = 2 * (c.k1 + r2 * (2 * c.k2 + 3 * r2 * c.k3));  // d radial / d x = d * x
    *jacobian << radial + d * x * x + 2 * c.p1 * y + 6 * c.p2 * x, d * x * y + 2 * c.p1 * x + 2 * c.p2 * y,
        d * x * y + 2 * c.p1 * x + 2 * c.p2 * y, radial + d * y * y + 6 * c.p1 * y + 2 * c.p2 * x;
  }
  return {x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x),
          y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y};
}

Eigen::Vector2d undistort(const CameraParameters& c, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d u = distorted;
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d miss = distort(c, u, &jacobian) - distorted;
    const double det = jacobian.determinant();
    if (std::abs(det) < 1e-6) break;  // beyond the fold of a wild lens model: the last guess is as good as any
    const Eigen::Vector2d step = jacobian.inverse() * miss;
    u -= step;
    if (step.squaredNorm() < 1e-24) break;
  }
  return u;
}

}  // namespace

CameraModel::CameraModel(const CameraParameters& parameters)
    : parameters_(parameters),
      rotation_(rotation_of(parameters.camera_from_bed_rotation)),
      translation_(parameters.camera_from_bed_translation.data()) {}

Point<CameraFrame> CameraModel::camera_from_bed(Point<BedFrame> place, Millimetres height) const {
  const Eigen::Vector3d p =
      rotation_ * Eigen::Vector3d(place.x.count(), place.y.count(), height.count()) + translation_;
  const Eigen::Vector2d d = distort(parameters_, p.head<2>() / p.z());
  return point<CameraFrame>(parameters_.fx * d.x() + parameters_.cx, parameters_.fy * d.y() + parameters_.cy);
}

Point<BedFrame> CameraModel::bed_from_camera(Point<CameraFrame> seen, Millimetres height) const {
  const Eigen::Vector2d u = undistort(parameters_, {(seen.x.count() - parameters_.cx) / parameters_.fx,
                                                    (seen.y.count() - parameters_.cy) / parameters_.fy});
  const Eigen::Vector3d ray = rotation_.transpose() * Eigen::Vector3d(u.x(), u.y(), 1);
  const Eigen::Vector3d eye = -(rotation_.transpose() * translation_);
  const double along = (height.count() - eye.z()) / ray.z();
  return point<BedFrame>(eye.x() + along * ray.x(), eye.y() + along * ray.y());
}

cv::Mat CameraModel::rectify(const cv::Mat& picture, const Box<BedFrame>& area, ScanResolution resolution,
                             Millimetres height) const {
  const int columns = std::max(1, static_cast<int>(std::lround(resolution.to_px(area.width()).count())));
  const int rows = std::max(1, static_cast<int>(std::lround(resolution.to_px(area.height()).count())));
  cv::Mat from_x(rows, columns, CV_32FC1), from_y(rows, columns, CV_32FC1);
  cv::parallel_for_(cv::Range(0, rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      const Millimetres y = area.min.y + resolution.to_mm(Pixels(rows - r - 0.5));
      auto* xs = from_x.ptr<float>(r);
      auto* ys = from_y.ptr<float>(r);
      for (int c = 0; c < columns; ++c) {
        const auto seen = camera_from_bed({area.min.x + resolution.to_mm(Pixels(c + 0.5)), y}, height);
        xs[c] = static_cast<float>(seen.x.count()) - kOpenCvPixelShift;
        ys[c] = static_cast<float>(seen.y.count()) - kOpenCvPixelShift;
      }
    }
  });
  cv::Mat out;
  cv::remap(picture, out, from_x, from_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar::all(0));
  return out;
}

CameraModel CameraModel::re_anchored(const Isometry2<BedFrame, BedFrame>& new_from_old) const {
  const double angle = new_from_old.angle().count();
  Eigen::Matrix3d old_from_new = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d shift(new_from_old.shift().x.count(), new_from_old.shift().y.count(), 0);
  const Eigen::Matrix3d rotation = rotation_ * old_from_new;
  const Eigen::Vector3d translation = translation_ - rotation * shift;
  CameraParameters moved = parameters_;
  moved.camera_from_bed_rotation = axis_angle_of(rotation);
  moved.camera_from_bed_translation = {translation.x(), translation.y(), translation.z()};
  return CameraModel(moved);
}

}  // namespace veneer::calib
