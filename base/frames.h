// Maps between frames. A map is named to_from and composes only in the right order: bed_from_panel * panel_from_scan
// compiles, the swapped order does not.
//
// Isometry2 moves without stretching, proper (rotation) or improper (with a reflection: the back of a panel on the
// bed). Affine2 may also scale and skew. Both are values; thread-safe as such.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <type_traits>
#include <vector>

#include "base/geometry.h"

namespace veneer {

enum class Handedness { kProper, kImproper };  // determinant +1, -1

template <class To, class From>
class Affine2 {
 public:
  using To_ = To;
  using From_ = From;
  Affine2() : linear_(Eigen::Matrix2d::Identity()), shift_(Eigen::Vector2d::Zero()) {}
  Affine2(const Eigen::Matrix2d& linear, const Eigen::Vector2d& shift) : linear_(linear), shift_(shift) {}

  Point<To> operator*(const Point<From>& p) const {
    const Eigen::Vector2d q = linear_ * Eigen::Vector2d(p.x.count(), p.y.count()) + shift_;
    return point<To>(q.x(), q.y());
  }
  std::vector<Point<To>> operator*(const std::vector<Point<From>>& points) const {
    std::vector<Point<To>> out;
    out.reserve(points.size());
    for (const auto& p : points) out.push_back(*this * p);
    return out;
  }
  template <class Before>
  Affine2<To, Before> operator*(const Affine2<From, Before>& o) const {
    return {linear_ * o.linear(), linear_ * o.shift() + shift_};
  }
  Affine2<From, To> inverse() const {
    const Eigen::Matrix2d inv = linear_.inverse();
    return {inv, -(inv * shift_)};
  }
  double determinant() const { return linear_.determinant(); }
  const Eigen::Matrix2d& linear() const { return linear_; }
  const Eigen::Vector2d& shift() const { return shift_; }

 private:
  Eigen::Matrix2d linear_;
  Eigen::Vector2d shift_;
};

template <class To, class From>
class Isometry2 {
  static_assert(std::is_same_v<typename To::Length, typename From::Length>, "an isometry keeps the unit");

 public:
  Isometry2() = default;
  // p -> R(angle) * F * p + shift, where F mirrors x (x -> -x) when the map is improper.
  Isometry2(Radians angle, Point<To> shift, Handedness handedness = Handedness::kProper)
      : angle_(angle), shift_(shift), handedness_(handedness) {}

  Point<To> operator*(const Point<From>& p) const {
    const double c = std::cos(angle_.count()), s = std::sin(angle_.count());
    const double x = handedness_ == Handedness::kImproper ? -p.x.count() : p.x.count(), y = p.y.count();
    return point<To>(c * x - s * y + shift_.x.count(), s * x + c * y + shift_.y.count());
  }
  std::vector<Point<To>> operator*(const std::vector<Point<From>>& points) const {
    std::vector<Point<To>> out;
    out.reserve(points.size());
    for (const auto& p : points) out.push_back(*this * p);
    return out;
  }
  template <class Before>
  Isometry2<To, Before> operator*(const Isometry2<From, Before>& o) const {
    const bool flip = handedness_ == Handedness::kImproper;
    // F R(a) = R(-a) F, so the angle of what comes first counts backwards through a reflection.
    return {angle_ + (flip ? -o.angle() : o.angle()), *this * o.shift(),
            (handedness_ == o.handedness()) ? Handedness::kProper : Handedness::kImproper};
  }
  Isometry2<From, To> inverse() const {
    const Radians angle = handedness_ == Handedness::kImproper ? angle_ : -angle_;
    const Isometry2<From, To> turn(angle, {}, handedness_);
    const Point<From> back = turn * shift_;
    return {angle, {-back.x, -back.y}, handedness_};
  }
  Affine2<To, From> affine() const {
    const double c = std::cos(angle_.count()), s = std::sin(angle_.count());
    const double f = handedness_ == Handedness::kImproper ? -1 : 1;
    Eigen::Matrix2d linear;
    linear << f * c, -s, f * s, c;
    return {linear, Eigen::Vector2d(shift_.x.count(), shift_.y.count())};
  }
  Radians angle() const { return angle_; }
  Point<To> shift() const { return shift_; }
  Handedness handedness() const { return handedness_; }

 private:
  Radians angle_;
  Point<To> shift_{};
  Handedness handedness_ = Handedness::kProper;
};

}  // namespace veneer
