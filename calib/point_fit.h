// Least-squares maps between two lists of points, in closed form.
//
// Both lists are equally long and in the same order. Values in, values out; thread-safe.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <span>

#include "base/frames.h"

namespace veneer::calib {

struct FitResidual {
  double rms = 0;  // root mean square of the distances, in the target frame's unit
  double max = 0;
};

template <class Map, class To, class From>
FitResidual residual_of(const Map& to_from, std::span<const Point<To>> to, std::span<const Point<From>> from) {
  FitResidual out;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double d = distance(to_from * from[i], to[i]).count();
    out.rms += d * d;
    out.max = std::max(out.max, d);
  }
  if (!to.empty()) out.rms = std::sqrt(out.rms / static_cast<double>(to.size()));
  return out;
}

// Umeyama's method (1991) in the plane, without scale. At least two points that differ. The handedness is the caller's;
// fit both and compare to measure it.
template <class To, class From>
Isometry2<To, From> fit_isometry(std::span<const Point<To>> to, std::span<const Point<From>> from,
                                 Handedness handedness = Handedness::kProper) {
  const double flip = handedness == Handedness::kImproper ? -1 : 1;
  Eigen::Vector2d to_mean = Eigen::Vector2d::Zero(), from_mean = Eigen::Vector2d::Zero();
  const double n = static_cast<double>(to.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    to_mean += Eigen::Vector2d(to[i].x.count(), to[i].y.count()) / n;
    from_mean += Eigen::Vector2d(flip * from[i].x.count(), from[i].y.count()) / n;
  }
  double cosine = 0, sine = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double ax = flip * from[i].x.count() - from_mean.x(), ay = from[i].y.count() - from_mean.y();
    const double bx = to[i].x.count() - to_mean.x(), by = to[i].y.count() - to_mean.y();
    cosine += ax * bx + ay * by;
    sine += ax * by - ay * bx;
  }
  const double angle = std::atan2(sine, cosine), c = std::cos(angle), s = std::sin(angle);
  const Point<To> shift = point<To>(to_mean.x() - (c * from_mean.x() - s * from_mean.y()),
                                    to_mean.y() - (s * from_mean.x() + c * from_mean.y()));
  return {Radians(angle), shift, handedness};
}

// At least three points that do not lie on one line.
template <class To, class From>
Affine2<To, From> fit_affine(std::span<const Point<To>> to, std::span<const Point<From>> from) {
  const auto n = static_cast<Eigen::Index>(to.size());
  Eigen::MatrixXd design(n, 3), seen(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& a = from[static_cast<std::size_t>(i)];
    const auto& b = to[static_cast<std::size_t>(i)];
    design.row(i) << a.x.count(), a.y.count(), 1;
    seen.row(i) << b.x.count(), b.y.count();
  }
  const Eigen::MatrixXd solved = design.colPivHouseholderQr().solve(seen);  // 3 x 2
  return {solved.topRows<2>().transpose(), solved.row(2).transpose()};
}

}  // namespace veneer::calib
