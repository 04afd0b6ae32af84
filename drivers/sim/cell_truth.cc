#include "drivers/sim/cell_truth.h"

#include <algorithm>
#include <cmath>

#include "base/units.h"
#include "drivers/sim/random.h"

namespace veneer::sim {
namespace {

constexpr double kTurn = 2 * kPi;

double wave(const ScannerTruth::Wave& w, double at) {
  return w.amplitude_mm * std::sin(kTurn * at / w.wavelength_mm + w.phase_rad);
}

ScannerTruth draw_scanner(const TwinSettings& settings) {
  Random random(settings.seed, "scanner");
  const TwinSettings::Scanner& s = settings.scanner;
  ScannerTruth truth;
  truth.width_mm = s.width_mm, truth.height_mm = s.height_mm;
  truth.x_scale = random.error(s.scale_error), truth.y_scale = random.error(s.scale_error);
  truth.skew = random.error(s.scale_error / 6);
  for (std::array<double, 6>* warp : {&truth.warp_x, &truth.warp_y}) {
    double sum = 0;
    for (double& k : *warp) sum += std::abs(k = random.spread(1));
    for (double& k : *warp) k *= s.warp_mm * random.uniform(0.7, 1.0) / std::max(sum, 1e-9);
  }
  for (ScannerTruth::Wave* w : {&truth.wobble_xx, &truth.wobble_xy, &truth.wobble_yx, &truth.wobble_yy}) {
    const bool main = w == &truth.wobble_xx || w == &truth.wobble_yy;
    *w = {s.wobble_mm * (main ? random.uniform(0.8, 1.1) : random.uniform(0.2, 0.4)), random.uniform(55, 68),
          random.uniform(0, kTurn)};
  }
  truth.psf_px = s.psf_px, truth.noise = s.noise, truth.dust = s.dust, truth.uneven_light = s.uneven_light;
  truth.light_seed = random.next() >> 12;
  return truth;
}

using Matrix3 = std::array<double, 9>;

Matrix3 multiply(const Matrix3& a, const Matrix3& b) {
  Matrix3 out{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) out[3 * r + c] += a[3 * r + k] * b[3 * k + c];
    }
  }
  return out;
}

// The camera hangs over the bed, tilted, its picture's upper edge away from the operator; its focal length is such that
// the whole bed is in the picture with a little margin.
CameraTruth draw_camera(const TwinSettings& settings) {
  Random random(settings.seed, "camera");
  const TwinSettings::Camera& s = settings.camera;
  CameraTruth truth;
  truth.width_px = s.width_px, truth.height_px = s.height_px;
  truth.noise = s.noise, truth.uneven_light = s.uneven_light;
  truth.light_seed = random.next() >> 12;
  const double tilt = degrees(random.error(s.tilt_deg, 0.5)).count(),
               roll = degrees(random.error(s.tilt_deg / 3)).count();
  const double turn = degrees(random.error(2.0)).count(), height = random.uniform(460, 540);
  // Looking straight down: camera x = bed x, camera y = -bed y, camera z = -bed z.
  const Matrix3 down = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  const Matrix3 about_x = {1, 0, 0, 0, std::cos(tilt), -std::sin(tilt), 0, std::sin(tilt), std::cos(tilt)};
  const Matrix3 about_y = {std::cos(roll), 0, std::sin(roll), 0, 1, 0, -std::sin(roll), 0, std::cos(roll)};
  const Matrix3 about_z = {std::cos(turn), -std::sin(turn), 0, std::sin(turn), std::cos(turn), 0, 0, 0, 1};
  truth.rotation = multiply(multiply(multiply(about_z, about_y), about_x), down);
  // The optical axis meets the middle of the bed, give or take.
  const Vec2 aim{settings.bed.width_mm / 2 + random.spread(8), settings.bed.height_mm / 2 + random.spread(8)};
  const double axis_x = truth.rotation[6], axis_y = truth.rotation[7], axis_z = truth.rotation[8];
  truth.position = {aim.x + axis_x * height / axis_z, aim.y + axis_y * height / axis_z, height};
  truth.k1 = -0.1 * random.uniform(0.8, 1.2), truth.k2 = random.uniform(0.01, 0.03);
  truth.p1 = random.spread(6e-4), truth.p2 = random.spread(6e-4);
  truth.cx = s.width_px / 2.0 + random.spread(0.008 * s.width_px);
  truth.cy = s.height_px / 2.0 + random.spread(0.008 * s.height_px);
  const double aspect = 1 + random.spread(5e-4), margin = 0.012 * s.width_px;
  const auto fits = [&](double f) {
    truth.fx = f, truth.fy = f * aspect;
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{settings.bed.width_mm, 0}, Vec2{0, settings.bed.height_mm},
                              Vec2{settings.bed.width_mm, settings.bed.height_mm}}) {
      for (const double z : {0.0, 20.0}) {
        const Vec2 p = truth.pixel(corner, z);
        if (p.x < margin || p.y < margin || p.x > s.width_px - margin || p.y > s.height_px - margin) return false;
      }
    }
    return true;
  };
  double low = 0.2 * s.width_px, high = 2.0 * s.width_px;
  for (int i = 0; i < 40; ++i) (fits((low + high) / 2) ? low : high) = (low + high) / 2;
  truth.fx = low, truth.fy = low * aspect;
  return truth;
}

}  // namespace

Vec2 ScannerTruth::glass_from_nominal(Vec2 n) const {
  const double u = 2 * n.x / width_mm - 1, v = 2 * n.y / height_mm - 1;
  const std::array<double, 6> terms = {u * u, u * v, v * v, u * u * u, u * u * v, v * v * v};
  double dx = 0, dy = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) dx += warp_x[i] * terms[i], dy += warp_y[i] * terms[i];
  dx += wave(wobble_xx, n.x) + wave(wobble_xy, n.y);
  dy += wave(wobble_yx, n.x) + wave(wobble_yy, n.y);
  return {(1 + x_scale) * n.x + skew * n.y + dx, (1 + y_scale) * n.y + dy};
}

Vec2 ScannerTruth::nominal_from_glass(Vec2 glass) const {
  Vec2 n = glass;
  for (int i = 0; i < 30; ++i) {
    const Vec2 miss = glass - glass_from_nominal(n);
    n = n + miss;
    if (std::abs(miss.x) + std::abs(miss.y) < 1e-11) break;
  }
  return n;
}

Vec2 CameraTruth::pixel(Vec2 bed, double z) const {
  const double dx = bed.x - position[0], dy = bed.y - position[1], dz = z - position[2];
  const double w = rotation[6] * dx + rotation[7] * dy + rotation[8] * dz;
  const double x = (rotation[0] * dx + rotation[1] * dy + rotation[2] * dz) / w;
  const double y = (rotation[3] * dx + rotation[4] * dy + rotation[5] * dz) / w;
  const double r2 = x * x + y * y, radial = 1 + k1 * r2 + k2 * r2 * r2;
  return {fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
          fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy};
}

Vec2 CameraTruth::bed_at(Vec2 p, double z) const {
  const double xd = (p.x - cx) / fx, yd = (p.y - cy) / fy;
  double x = xd, y = yd;
  for (int i = 0; i < 60; ++i) {
    const double r2 = x * x + y * y, radial = 1 + k1 * r2 + k2 * r2 * r2;
    const double nx = (xd - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial;
    const double ny = (yd - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial;
    const double change = std::abs(nx - x) + std::abs(ny - y);
    x = nx, y = ny;
    if (change < 1e-14) break;
  }
  // The ray in the bed frame is the transposed rotation of (x, y, 1).
  const double rx = rotation[0] * x + rotation[3] * y + rotation[6];
  const double ry = rotation[1] * x + rotation[4] * y + rotation[7];
  const double rz = rotation[2] * x + rotation[5] * y + rotation[8];
  const double t = (z - position[2]) / rz;
  return {position[0] + t * rx, position[1] + t * ry};
}

ScannerTruth scanner_of_today(const CellTruth& truth, std::uint64_t scan) {
  ScannerTruth today = truth.scanner;
  const Roughness& rough = truth.settings.rough;
  Random random(truth.settings.seed, "scanner of the day", scan);
  for (std::array<double, 6>* warp : {&today.warp_x, &today.warp_y})
    for (double& k : *warp) k += random.spread(rough.scan_warp_mm / 3);
  for (double& colour : today.lamp) colour += random.spread(rough.scan_colour);
  return today;
}

CellTruth draw_cell_truth(const TwinSettings& settings) {
  CellTruth truth;
  truth.settings = settings;
  Random random(settings.seed, "laser");
  truth.axes = {random.error(settings.laser.axis_scale_error), random.error(settings.laser.axis_scale_error),
                random.error(settings.laser.axis_skew)};
  truth.kerf_mm = random.uniform(0.24, 0.30);
  truth.scanner = draw_scanner(settings);
  truth.camera = draw_camera(settings);
  return truth;
}

}  // namespace veneer::sim
