// Points and shapes, each with its frame in the type (docs/FRAMES.md).
//
// A frame says what its coordinates count: millimetre frames have +x right and +y up (away from the operator); pixel
// frames have +y down and pixel centres at +0.5.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/units.h"

namespace veneer {

struct ScanFrame {  // pixels of one raw scan
  using Length = Pixels;
};
struct PanelFrame {  // mm on the panel's show face, seen from the show face
  using Length = Millimetres;
};
struct CameraFrame {  // pixels of one bed-camera image
  using Length = Pixels;
};
struct BedFrame {  // true mm on the laser bed, seen from above
  using Length = Millimetres;
};
struct MachineFrame {  // mm as commanded to the controller
  using Length = Millimetres;
};
struct ArtworkFrame {  // mm in the assembled picture, seen from the show side
  using Length = Millimetres;
};
struct TargetFrame {  // pixels of the target image
  using Length = Pixels;
};

template <class Frame>
struct Point {
  using Length = typename Frame::Length;
  Length x, y;
  friend constexpr bool operator==(const Point&, const Point&) = default;
};

template <class Frame>
constexpr Point<Frame> point(double x, double y) {
  return {typename Frame::Length(x), typename Frame::Length(y)};
}

template <class Frame>
typename Frame::Length distance(const Point<Frame>& a, const Point<Frame>& b) {
  return typename Frame::Length(std::hypot((a.x - b.x).count(), (a.y - b.y).count()));
}

// The point of the straight line from a to b that lies nearest to p.
template <class Frame>
Point<Frame> nearest_on_segment(const Point<Frame>& p, const Point<Frame>& a, const Point<Frame>& b) {
  const double ux = (b.x - a.x).count(), uy = (b.y - a.y).count(), squared = ux * ux + uy * uy;
  if (squared <= 0) return a;
  const double along = (p.x - a.x).count() * ux + (p.y - a.y).count() * uy;
  const double t = std::clamp(along / squared, 0.0, 1.0);
  return point<Frame>(a.x.count() + ux * t, a.y.count() + uy * t);
}

// An open path; at least two points when it is drawn.
template <class Frame>
using Polyline = std::vector<Point<Frame>>;

// A closed simple outline; the last point is joined to the first and not repeated.
template <class Frame>
using Ring = std::vector<Point<Frame>>;

// Signed area: positive when the ring runs counter-clockwise with +y up.
template <class Frame>
double signed_area(const Ring<Frame>& ring) {
  double twice = 0;
  for (std::size_t i = 0, n = ring.size(); i < n; ++i) {
    const auto& a = ring[i];
    const auto& b = ring[(i + 1) % n];
    twice += a.x.count() * b.y.count() - b.x.count() * a.y.count();
  }
  return twice / 2;
}

template <class Frame>
struct Box {
  using Length = typename Frame::Length;
  Point<Frame> min{Length(std::numeric_limits<double>::infinity()), Length(std::numeric_limits<double>::infinity())};
  Point<Frame> max{Length(-std::numeric_limits<double>::infinity()), Length(-std::numeric_limits<double>::infinity())};

  bool empty() const { return max.x < min.x || max.y < min.y; }
  Length width() const { return max.x - min.x; }
  Length height() const { return max.y - min.y; }
  void add(const Point<Frame>& p) {
    min.x = std::min(min.x, p.x), min.y = std::min(min.y, p.y);
    max.x = std::max(max.x, p.x), max.y = std::max(max.y, p.y);
  }
  bool contains(const Point<Frame>& p) const { return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y; }
};

template <class Frame>
Box<Frame> bounds(const std::vector<Point<Frame>>& points) {
  Box<Frame> box;
  for (const auto& p : points) box.add(p);
  return box;
}

}  // namespace veneer
