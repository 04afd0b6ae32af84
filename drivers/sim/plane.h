// The twin's own flat geometry. It shares none with what it checks, so that errors cannot cancel: nothing here comes
// from base/geometry.h or base/frames.h.
//
// Millimetre frames of the twin, all with +x right and +y up:
//   sheet  origin at the lower left of the sheet as seen from its show face; both faces use it, as through the sheet
//   glass  what lies on the scanner, as the scan shows it; origin at the lower left of the glass
//   bed    true mm on the laser bed, from above; origin where the machine's commanded (0, 0) goes, +x along its x axis
// Pixels have y down and centres at +0.5.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace veneer::sim {

struct Vec2 {
  double x = 0, y = 0;
  friend Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2 operator*(Vec2 a, double k) { return {a.x * k, a.y * k}; }
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

inline double length(Vec2 v) { return std::hypot(v.x, v.y); }

inline double distance_to_segment(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 d = b - a, q = p - a;
  const double square = d.x * d.x + d.y * d.y;
  const double t = square > 0 ? std::clamp((q.x * d.x + q.y * d.y) / square, 0.0, 1.0) : 0.0;
  return length(q - d * t);
}

// sheet -> glass or bed: p -> R(angle) * F * p + shift, F mirroring x when the sheet shows its back to the viewer.
struct SheetPose {
  double angle_rad = 0;
  bool mirrored = false;
  Vec2 shift{};

  Vec2 place(Vec2 sheet) const {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad), x = mirrored ? -sheet.x : sheet.x;
    return {c * x - s * sheet.y + shift.x, s * x + c * sheet.y + shift.y};
  }
  Vec2 back_to_sheet(Vec2 placed) const {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    const Vec2 d = placed - shift;
    const double x = c * d.x + s * d.y, y = -s * d.x + c * d.y;
    return {mirrored ? -x : x, y};
  }
};

}  // namespace veneer::sim
