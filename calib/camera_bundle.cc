#include "calib/camera_bundle.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

using CameraVector = Eigen::Matrix<double, kCameraUnknowns, 1>;
constexpr int kBoth = kCameraUnknowns + kSheetUnknowns;

CameraVector pack(const CameraParameters& c) {
  CameraVector v;
  v << c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.camera_from_bed_rotation[0],
      c.camera_from_bed_rotation[1], c.camera_from_bed_rotation[2], c.camera_from_bed_translation[0],
      c.camera_from_bed_translation[1], c.camera_from_bed_translation[2];
  return v;
}

CameraParameters unpack(const CameraVector& v, const CameraParameters& size_of) {
  CameraParameters c = size_of;
  c.fx = v[0], c.fy = v[1], c.cx = v[2], c.cy = v[3];
  c.k1 = v[4], c.k2 = v[5], c.p1 = v[6], c.p2 = v[7], c.k3 = v[8];
  c.camera_from_bed_rotation = {v[9], v[10], v[11]};
  c.camera_from_bed_translation = {v[12], v[13], v[14]};
  return c;
}

// Steps of the numeric derivative, in each unknown's own unit.
constexpr double kSteps[kBoth] = {1e-2, 1e-2, 1e-2, 1e-2, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6,
                                  1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-6};

// What a camera may be expected to be; far wider than any real spread.
struct Prior {
  int unknown;
  double mean, sigma;
};
std::vector<Prior> priors_of(const CameraParameters& c) {
  return {{2, c.width_px / 2.0, 0.05 * c.width_px},
          {3, c.height_px / 2.0, 0.05 * c.width_px},
          {4, 0, 0.5},
          {5, 0, 0.3},
          {6, 0, 0.01},
          {7, 0, 0.01},
          {8, 0, 0.05}};
}

using Residuals = std::vector<Eigen::Vector2d>;

void append_residuals(const CameraModel& camera, const BundleSheet& sheet, Residuals& out) {
  for (const BundleCorner& corner : sheet.corners) {
    const Eigen::Vector2d bed = sheet.on_bed(corner.sheet);
    const auto p = camera.camera_from_bed(point<BedFrame>(bed.x(), bed.y()), Millimetres(sheet.height));
    out.emplace_back(p.x.count() - corner.seen.x(), p.y.count() - corner.seen.y());
  }
}

double squared_px(const BundleState& state, Residuals& residuals) {
  residuals.clear();
  const CameraModel camera(state.camera);
  for (const auto& sheet : state.sheets) append_residuals(camera, sheet, residuals);
  double sum = 0;
  for (const auto& r : residuals) sum += r.squaredNorm();
  return sum;
}

double prior_cost(const CameraParameters& camera) {
  const CameraVector v = pack(camera);
  double sum = 0;
  for (const Prior& p : priors_of(camera)) sum += std::pow((v[p.unknown] - p.mean) / p.sigma, 2);
  // Square pixels: fx and fy of one sensor differ by less than 1 %.
  return sum + std::pow((v[0] - v[1]) / (0.01 * v[0]), 2);
}

struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

// Adds one sheet's corners to the normal equations. `at` is the index of the sheet's unknowns, negative when held.
void add_sheet(const CameraParameters& camera, const BundleSheet& sheet, int at, double weight, Normal& normal) {
  const CameraVector v = pack(camera);
  const int unknowns = at < 0 ? kCameraUnknowns : kBoth;
  Residuals here, plus, minus;
  append_residuals(CameraModel(camera), sheet, here);
  const auto rows = static_cast<Eigen::Index>(2 * here.size());
  Eigen::MatrixXd jacobian(rows, unknowns);
  Eigen::VectorXd residual(rows);
  for (std::size_t i = 0; i < here.size(); ++i) residual.segment<2>(static_cast<Eigen::Index>(2 * i)) = here[i];
  for (int k = 0; k < unknowns; ++k) {
    plus.clear(), minus.clear();
    if (k < kCameraUnknowns) {
      CameraVector up = v, down = v;
      up[k] += kSteps[k], down[k] -= kSteps[k];
      append_residuals(CameraModel(unpack(up, camera)), sheet, plus);
      append_residuals(CameraModel(unpack(down, camera)), sheet, minus);
    } else {
      BundleSheet up = sheet, down = sheet;
      up.place[k - kCameraUnknowns] += kSteps[k], down.place[k - kCameraUnknowns] -= kSteps[k];
      append_residuals(CameraModel(camera), up, plus);
      append_residuals(CameraModel(camera), down, minus);
    }
    for (std::size_t i = 0; i < here.size(); ++i) {
      jacobian.block<2, 1>(static_cast<Eigen::Index>(2 * i), k) = (plus[i] - minus[i]) / (2 * kSteps[k]);
    }
  }
  const Eigen::MatrixXd matrix = weight * jacobian.transpose() * jacobian;
  const Eigen::VectorXd gradient = weight * jacobian.transpose() * residual;
  constexpr int kC = kCameraUnknowns, kS = kSheetUnknowns;
  normal.matrix.topLeftCorner(kC, kC) += matrix.topLeftCorner(kC, kC);
  normal.gradient.head(kC) += gradient.head(kC);
  if (at < 0) return;
  normal.matrix.block(at, at, kS, kS) += matrix.bottomRightCorner(kS, kS);
  normal.matrix.block(0, at, kC, kS) += matrix.topRightCorner(kC, kS);
  normal.matrix.block(at, 0, kS, kC) += matrix.bottomLeftCorner(kS, kC);
  normal.gradient.segment(at, kS) += gradient.tail(kS);
}

void add_priors(const CameraParameters& camera, Normal& normal) {
  const CameraVector v = pack(camera);
  for (const Prior& p : priors_of(camera)) {
    const double weight = 1 / (p.sigma * p.sigma);
    normal.matrix(p.unknown, p.unknown) += weight;
    normal.gradient[p.unknown] += weight * (v[p.unknown] - p.mean);
  }
  const double weight = 1 / std::pow(0.01 * v[0], 2);
  normal.matrix(0, 0) += weight, normal.matrix(1, 1) += weight;
  normal.matrix(0, 1) -= weight, normal.matrix(1, 0) -= weight;
  normal.gradient[0] += weight * (v[0] - v[1]), normal.gradient[1] -= weight * (v[0] - v[1]);
}

Normal normal_equations(const BundleState& state, double weight) {
  const int size = kCameraUnknowns + kSheetUnknowns * (static_cast<int>(state.sheets.size()) - 1);
  Normal normal{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  for (std::size_t s = 0; s < state.sheets.size(); ++s) {
    const int at = s == 0 ? -1 : kCameraUnknowns + kSheetUnknowns * (static_cast<int>(s) - 1);
    add_sheet(state.camera, state.sheets[s], at, weight, normal);
  }
  add_priors(state.camera, normal);
  return normal;
}

BundleState stepped(const BundleState& state, const Eigen::VectorXd& step) {
  BundleState next = state;
  next.camera = unpack(pack(state.camera) + step.head<kCameraUnknowns>(), state.camera);
  for (std::size_t s = 1; s < next.sheets.size(); ++s) {
    next.sheets[s].place += step.segment<kSheetUnknowns>(kCameraUnknowns + kSheetUnknowns * (static_cast<int>(s) - 1));
  }
  return next;
}

}  // namespace

Eigen::Vector2d BundleSheet::on_bed(const Eigen::Vector2d& sheet) const {
  const double c = std::cos(place.z()), s = std::sin(place.z());
  return {c * sheet.x() - s * sheet.y() + place.x(), s * sheet.x() + c * sheet.y() + place.y()};
}

BundleOutcome solve_bundle(BundleState& state, double noise_px, int max_steps) {
  const double weight = 1 / (noise_px * noise_px);
  Residuals residuals;
  const auto cost_of = [&](const BundleState& s) { return weight * squared_px(s, residuals) + prior_cost(s.camera); };

  double cost = cost_of(state), damping = 1e-4;
  Normal normal = normal_equations(state, weight);
  for (int i = 0; i < max_steps && damping < 1e8; ++i) {
    Eigen::MatrixXd damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = -damped.ldlt().solve(normal.gradient);
    BundleState next = stepped(state, step);
    const double next_cost = cost_of(next);
    if (!(next_cost < cost)) {  // also when it is not a number
      damping *= 10;
      continue;
    }
    const double gain = (cost - next_cost) / cost;
    state = std::move(next), cost = next_cost, damping = std::max(damping / 10, 1e-12);
    normal = normal_equations(state, weight);
    if (gain < 1e-9) break;
  }
  const double sum = squared_px(state, residuals);
  return {cost, std::sqrt(sum / std::max<double>(1, static_cast<double>(residuals.size()))), normal.matrix};
}

Eigen::Matrix<double, 2, kCameraUnknowns> camera_jacobian(const CameraParameters& camera, const Point<BedFrame>& place,
                                                          Millimetres height) {
  const CameraVector v = pack(camera);
  Eigen::Matrix<double, 2, kCameraUnknowns> jacobian;
  for (int k = 0; k < kCameraUnknowns; ++k) {
    CameraVector up = v, down = v;
    up[k] += kSteps[k], down[k] -= kSteps[k];
    const auto a = CameraModel(unpack(up, camera)).camera_from_bed(place, height);
    const auto b = CameraModel(unpack(down, camera)).camera_from_bed(place, height);
    jacobian.col(k) << (a.x - b.x).count() / (2 * kSteps[k]), (a.y - b.y).count() / (2 * kSteps[k]);
  }
  return jacobian;
}

void place_sheet(const CameraModel& camera, BundleSheet& sheet) {
  std::vector<Point<BedFrame>> bed;
  std::vector<Point<SheetFrame>> on_sheet;
  for (const BundleCorner& corner : sheet.corners) {
    bed.push_back(
        camera.bed_from_camera(point<CameraFrame>(corner.seen.x(), corner.seen.y()), Millimetres(sheet.height)));
    on_sheet.push_back(point<SheetFrame>(corner.sheet.x(), corner.sheet.y()));
  }
  const auto bed_from_sheet = fit_isometry<BedFrame, SheetFrame>(bed, on_sheet);
  sheet.place = {bed_from_sheet.shift().x.count(), bed_from_sheet.shift().y.count(), bed_from_sheet.angle().count()};
}

}  // namespace veneer::calib
