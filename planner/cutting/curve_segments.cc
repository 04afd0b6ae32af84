#include "planner/cutting/curve_segments.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "planner/layout/bezier_fit.h"

namespace veneer::planner {
namespace {

// Curves come flattened to 0.01 mm (partition.h): where one of them is wider than half a millimetre it turns less at a
// point. What turns more is a corner.
constexpr double kCornerTurn = 25 * kPi / 180;
constexpr std::size_t kFewestChords = 3;  // of a curve
constexpr double kLongestChord = 0.5;     // mm between points that a curve is held to

PlanePoint plane(const Point<BedFrame>& p) { return {p.x.count(), p.y.count()}; }
Point<BedFrame> bed_point(const PlanePoint& p) { return point<BedFrame>(p.x, p.y); }

double turn(const Point<BedFrame>& a, const Point<BedFrame>& b, const Point<BedFrame>& c) {
  const double before = std::atan2((b.y - a.y).count(), (b.x - a.x).count());
  const double after = std::atan2((c.y - b.y).count(), (c.x - b.x).count());
  return std::abs(std::remainder(after - before, 2 * kPi));
}

PathSegment straight(const Point<BedFrame>& from, const Point<BedFrame>& to) {
  const auto part = [&](double t) {
    return Point<BedFrame>{from.x + (to.x - from.x) * t, from.y + (to.y - from.y) * t};
  };
  return {false, part(1.0 / 3), part(2.0 / 3), to};
}

// The way from corner to corner.
void add_run(std::span<const Point<BedFrame>> run, std::vector<PathSegment>& out) {
  const std::size_t chords = run.size() - 1;
  if (chords >= kFewestChords) {
    std::vector<PlanePoint> dense = {plane(run.front())};
    for (std::size_t i = 1; i < run.size(); ++i) {
      const PlanePoint a = plane(run[i - 1]), b = plane(run[i]);
      const int parts = std::max(1, static_cast<int>(std::ceil(std::hypot(b.x - a.x, b.y - a.y) / kLongestChord)));
      for (int k = 1; k <= parts; ++k)
        dense.push_back(k == parts ? b : PlanePoint{a.x + (b.x - a.x) * k / parts, a.y + (b.y - a.y) * k / parts});
    }
    const std::vector<Cubic> cubics = fit_cubics(dense, kCurveFit.count(), Smoothness::kG0);
    if (!cubics.empty() && cubics.size() < chords) {
      for (const Cubic& cubic : cubics)
        out.push_back({true, bed_point(cubic[1]), bed_point(cubic[2]), bed_point(cubic[3])});
      return;
    }
  }
  for (std::size_t i = 1; i < run.size(); ++i) out.push_back(straight(run[i - 1], run[i]));
}

}  // namespace

std::vector<PathSegment> segments_of(const Polyline<BedFrame>& path, bool closed) {
  Polyline<BedFrame> whole;
  for (const auto& p : path)
    if (whole.empty() || !(p == whole.back())) whole.push_back(p);
  if (closed && whole.size() > 1 && !(whole.back() == whole.front())) whole.push_back(whole.front());
  std::vector<PathSegment> out;
  const std::span<const Point<BedFrame>> points(whole);
  for (std::size_t from = 0, i = 1; i < whole.size(); ++i) {
    if (i + 1 < whole.size() && turn(whole[i - 1], whole[i], whole[i + 1]) <= kCornerTurn) continue;
    add_run(points.subspan(from, i - from + 1), out);
    from = i;
  }
  return out;
}

bool has_curves(const std::vector<PathSegment>& segments) {
  return std::any_of(segments.begin(), segments.end(), [](const PathSegment& it) { return it.curved; });
}

}  // namespace veneer::planner
