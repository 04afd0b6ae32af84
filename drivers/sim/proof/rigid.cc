#include "drivers/sim/proof/rigid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace veneer::proof {

Rigid Rigid::turn(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad), {}}; }

Rigid Rigid::inverse() const {
  const Vec2 back{-(cosine * shift.x + sine * shift.y), sine * shift.x - cosine * shift.y};
  return {cosine, -sine, back};
}

Rigid operator*(const Rigid& after, const Rigid& before) {
  return {after.cosine * before.cosine - after.sine * before.sine,
          after.sine * before.cosine + after.cosine * before.sine, after(before.shift)};
}

std::optional<Rigid> fit_rigid(const std::vector<Vec2>& from, const std::vector<Vec2>& to) {
  if (from.size() != to.size() || from.size() < 2) return std::nullopt;
  Vec2 a{};
  Vec2 b{};
  for (std::size_t i = 0; i < from.size(); ++i) {
    a = a + from[i];
    b = b + to[i];
  }
  const double share = 1.0 / static_cast<double>(from.size());
  a = a * share;
  b = b * share;
  double same = 0;
  double cross = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec2 p = from[i] - a;
    const Vec2 q = to[i] - b;
    same += p.x * q.x + p.y * q.y;
    cross += p.x * q.y - p.y * q.x;
  }
  const double norm = std::hypot(same, cross);
  if (norm < 1e-12) return std::nullopt;
  Rigid m{same / norm, cross / norm, {}};
  m.shift = b - m.turned(a);
  return m;
}

void ResidualSum::add(double length) {
  squares_ += length * length;
  max_ = std::max(max_, length);
  ++count_;
}

void ResidualSum::add(const ResidualSum& other) {
  squares_ += other.squares_;
  max_ = std::max(max_, other.max_);
  count_ += other.count_;
}

Residual ResidualSum::result() const {
  if (count_ == 0) return {};
  return {std::sqrt(squares_ / static_cast<double>(count_)), max_, count_};
}

double ring_area(const std::vector<Vec2>& ring) {
  double twice = 0;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++)
    twice += ring[j].x * ring[i].y - ring[i].x * ring[j].y;
  return twice / 2;
}

Vec2 ring_centroid(const std::vector<Vec2>& ring) {
  if (ring.empty()) return {};
  const Vec2 base = ring.front();  // keeps the sums small
  double twice = 0;
  Vec2 sum{};
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2 p = ring[j] - base;
    const Vec2 q = ring[i] - base;
    const double cross = p.x * q.y - q.x * p.y;
    twice += cross;
    sum = sum + (p + q) * cross;
  }
  if (std::abs(twice) < 1e-12) return base;
  return base + sum * (1 / (3 * twice));
}

Nearest nearest_on_ring(const std::vector<Vec2>& ring, Vec2 p) {
  Nearest best;
  best.distance = std::numeric_limits<double>::max();
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2 edge = ring[i] - ring[j];
    const double length_sqr = edge.x * edge.x + edge.y * edge.y;
    const Vec2 d = p - ring[j];
    const double t = length_sqr > 0 ? std::clamp((d.x * edge.x + d.y * edge.y) / length_sqr, 0.0, 1.0) : 0;
    const Vec2 at = ring[j] + edge * t;
    const double distance = std::hypot(p.x - at.x, p.y - at.y);
    if (distance >= best.distance) continue;
    best.distance = distance;
    best.point = at;
    best.along = length_sqr > 0 ? edge * (1 / std::sqrt(length_sqr)) : Vec2{1, 0};
  }
  return best;
}

}  // namespace veneer::proof
