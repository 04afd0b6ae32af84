// The proof's own rigid motions of the plane. Shares nothing with the cell's geometry.
#pragma once

#include <optional>
#include <vector>

#include "drivers/sim/plane.h"

namespace veneer::proof {

using sim::Vec2;

// p -> R(angle) p + shift. Never mirrored, never scaled.
struct Rigid {
  double cosine = 1, sine = 0;
  Vec2 shift{};

  static Rigid turn(double angle_rad);
  Vec2 operator()(Vec2 p) const { return {cosine * p.x - sine * p.y + shift.x, sine * p.x + cosine * p.y + shift.y}; }
  Vec2 turned(Vec2 v) const { return {cosine * v.x - sine * v.y, sine * v.x + cosine * v.y}; }
  Rigid inverse() const;
};

// after(before(p))
Rigid operator*(const Rigid& after, const Rigid& before);

// Least squares to[i] = m(from[i]). Nothing with fewer than two points or when all coincide.
std::optional<Rigid> fit_rigid(const std::vector<Vec2>& from, const std::vector<Vec2>& to);

// Root mean square and largest of a list of lengths.
struct Residual {
  double rms = 0, max = 0;
  std::size_t count = 0;
};
class ResidualSum {
 public:
  void add(double length);
  void add(const ResidualSum& other);
  std::size_t count() const { return count_; }
  Residual result() const;

 private:
  double squares_ = 0, max_ = 0;
  std::size_t count_ = 0;
};

// Area (positive when counter-clockwise) and centroid of a closed ring.
double ring_area(const std::vector<Vec2>& ring);
Vec2 ring_centroid(const std::vector<Vec2>& ring);
// Distance to the nearest point of the ring's boundary, and that point.
struct Nearest {
  double distance = 0;
  Vec2 point{};
  Vec2 along{};  // unit direction of the edge it lies on
};
Nearest nearest_on_ring(const std::vector<Vec2>& ring, Vec2 p);

}  // namespace veneer::proof
