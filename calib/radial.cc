#include "calib/radial.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/units.h"
#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr int kRadii = 120;

// Grey levels around a centre: one row per ray, one column per half pixel of radius.
struct Radial {
  double from = 0, step = 0.5;
  Eigen::MatrixXd levels;
  Eigen::VectorXd mean() const {
    // The median over the rays, so that a neighbour on one side does not count.
    Eigen::VectorXd out(levels.cols());
    std::vector<double> column(kRadii);
    for (Eigen::Index k = 0; k < levels.cols(); ++k) {
      for (int ray = 0; ray < kRadii; ++ray) column[static_cast<std::size_t>(ray)] = levels(ray, k);
      std::nth_element(column.begin(), column.begin() + kRadii / 2, column.end());
      out(k) = column[kRadii / 2];
    }
    return out;
  }
};

Eigen::Vector2d ray_direction(int ray) {
  const double angle = 2 * kPi * ray / kRadii;
  return {std::cos(angle), std::sin(angle)};
}

Radial look_around(const cv::Mat& grey, const Eigen::Vector2d& centre, double from, double to) {
  Radial around;
  around.from = from;
  const auto count = static_cast<Eigen::Index>((to - from) / around.step) + 1;
  around.levels.resize(kRadii, count);
  for (int ray = 0; ray < kRadii; ++ray)
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::Vector2d at = centre + ray_direction(ray) * (from + around.step * static_cast<double>(k));
      around.levels(ray, k) = level_at(grey, at.x(), at.y());
    }
  return around;
}

// Where the mean profile changes most between the two radii; 0 when it hardly changes.
double rim_radius(const cv::Mat& grey, const Eigen::Vector2d& centre, const RoundSearch& search, bool& brighter) {
  const Radial around = look_around(grey, centre, search.rim_from - 2, search.rim_to + 2);
  const Eigen::VectorXd mean = around.mean();
  double best = search.min_slope, radius = 0;
  for (Eigen::Index k = 3; k + 3 < mean.size(); ++k) {
    const double slope = std::abs(mean(k + 2) - mean(k - 2)) / (4 * around.step);
    if (slope <= best) continue;
    brighter = mean(k - 2) > mean(k + 2);
    best = slope, radius = around.from + around.step * static_cast<double>(k);
  }
  return radius;
}

// Moves the centre until every ray's profile lies on the mean profile (Lucas-Kanade on a round template), whatever
// that profile is: a plain edge, or a shadow before the bright lid.
void settle(const cv::Mat& grey, RoundFit& fit, const RoundSearch& search) {
  const double limit = search.stray_limit;
  Eigen::VectorXd stray = Eigen::VectorXd::Zero(kRadii);
  for (int pass = 0; pass < 12; ++pass) {
    const Radial around =
        look_around(grey, fit.centre, std::max(0.0, fit.rim - search.inside), fit.rim + search.outside);
    const Eigen::VectorXd mean = around.mean();
    const Eigen::Index n = mean.size();
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 1; k + 1 < n; ++k) slope(k) = (mean(k + 1) - mean(k - 1)) / (2 * around.step);
    const double power = slope.squaredNorm();
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (int ray = 0; ray < kRadii; ++ray) {
      stray(ray) = -slope.dot(around.levels.row(ray).transpose() - mean) / std::max(power, 1e-9);
      // Dust on the rim must not pull: rays count less the farther they stray (Tukey's weights).
      const double off = stray(ray) / (pass < 3 ? 3 * limit : limit);
      if (std::abs(off) > 1) continue;
      const double weight = (1 - off * off) * (1 - off * off);
      const Eigen::Vector2d d = ray_direction(ray);
      normal += weight * d * d.transpose();
      right += weight * d * stray(ray);
    }
    if (std::abs(normal.determinant()) < 1) break;
    const Eigen::Vector2d move = normal.ldlt().solve(right);
    fit.centre += move;
    if (move.norm() < 1e-3) break;
  }
  fit.seen = fit.rms = 0;
  for (int ray = 0; ray < kRadii; ++ray) {
    if (std::abs(stray(ray)) > limit) continue;
    fit.seen += 1, fit.rms += stray(ray) * stray(ray);
  }
  fit.rms = fit.seen > 0 ? std::sqrt(fit.rms / fit.seen) : limit;
  fit.seen /= kRadii;
}

}  // namespace

RoundFit fit_round(const cv::Mat& grey, const Eigen::Vector2d& centre, const RoundSearch& search) {
  RoundFit fit;
  fit.centre = centre;
  // The rim is looked for again once the centre is better.
  for (int pass = 0; pass < 2; ++pass) {
    fit.rim = rim_radius(grey, fit.centre, search, fit.brighter_inside);
    if (fit.rim == 0) return fit;
    settle(grey, fit, search);
  }
  return fit;
}

}  // namespace veneer::calib
