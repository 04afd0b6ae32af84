#include "base/polygon_ops.h"

#include <algorithm>
#include <limits>
#include <polyclipping/clipper.hpp>

namespace veneer::micro {
namespace {

using ClipperLib::cInt;

ClipperLib::Paths to_clipper(const MicroArea& area) {
  ClipperLib::Paths paths;
  paths.reserve(area.rings.size());
  for (const auto& ring : area.rings) {
    auto& path = paths.emplace_back();
    path.reserve(ring.size());
    for (const auto& p : ring) path.emplace_back(static_cast<cInt>(p.x_um), static_cast<cInt>(p.y_um));
  }
  return paths;
}

MicroArea from_clipper(const ClipperLib::Paths& paths) {
  MicroArea area;
  area.rings.reserve(paths.size());
  for (const auto& path : paths) {
    if (path.size() < 3) continue;
    auto& ring = area.rings.emplace_back();
    ring.reserve(path.size());
    for (const auto& p : path) ring.push_back({p.X, p.Y});
  }
  return area;
}

MicroArea combine(ClipperLib::ClipType type, const ClipperLib::Paths& subject, const ClipperLib::Paths& clip,
                  ClipperLib::PolyFillType subject_fill) {
  ClipperLib::Clipper clipper(ClipperLib::ioStrictlySimple);
  clipper.AddPaths(subject, ClipperLib::ptSubject, true);
  clipper.AddPaths(clip, ClipperLib::ptClip, true);
  ClipperLib::Paths out;
  clipper.Execute(type, out, subject_fill, ClipperLib::pftEvenOdd);
  return from_clipper(out);
}

}  // namespace

MicroArea unite(const MicroArea& a, const MicroArea& b) {
  return combine(ClipperLib::ctUnion, to_clipper(a), to_clipper(b), ClipperLib::pftEvenOdd);
}

MicroArea unite(const std::vector<MicroArea>& areas) {
  ClipperLib::Paths all;
  for (const auto& area : areas) {
    auto paths = to_clipper(area);
    all.insert(all.end(), paths.begin(), paths.end());
  }
  // Rings keep their direction (outer counter-clockwise), so overlapping areas add up instead of cancelling.
  return combine(ClipperLib::ctUnion, all, {}, ClipperLib::pftPositive);
}

MicroArea subtract(const MicroArea& a, const MicroArea& b) {
  return combine(ClipperLib::ctDifference, to_clipper(a), to_clipper(b), ClipperLib::pftEvenOdd);
}

MicroArea intersect(const MicroArea& a, const MicroArea& b) {
  return combine(ClipperLib::ctIntersection, to_clipper(a), to_clipper(b), ClipperLib::pftEvenOdd);
}

MicroArea offset(const MicroArea& a, double delta_um, bool round) {
  constexpr double kMitreLimit = 2, kArcTolerance = 5;
  ClipperLib::ClipperOffset grower(kMitreLimit, kArcTolerance);
  grower.AddPaths(to_clipper(a), round ? ClipperLib::jtRound : ClipperLib::jtMiter, ClipperLib::etClosedPolygon);
  ClipperLib::Paths out;
  grower.Execute(out, delta_um);
  return from_clipper(out);
}

double area_um2(const MicroArea& a) {
  double sum = 0;
  for (const auto& path : to_clipper(a)) sum += ClipperLib::Area(path);
  return sum;
}

MicroBox box_of(const MicroArea& a) {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  MicroBox box{{kFar, kFar}, {-kFar, -kFar}};
  for (const auto& ring : a.rings)
    for (const auto& p : ring) {
      box.min = {std::min(box.min.x_um, p.x_um), std::min(box.min.y_um, p.y_um)};
      box.max = {std::max(box.max.x_um, p.x_um), std::max(box.max.y_um, p.y_um)};
    }
  return box;
}

bool boxes_overlap(const MicroArea& a, const MicroArea& b) {
  const MicroBox one = box_of(a), other = box_of(b);
  return one.min.x_um < other.max.x_um && other.min.x_um < one.max.x_um && one.min.y_um < other.max.y_um &&
         other.min.y_um < one.max.y_um;
}

std::size_t corners_of(const MicroArea& a) {
  std::size_t corners = 0;
  for (const auto& ring : a.rings) corners += ring.size();
  return corners;
}

bool contains(const MicroArea& a, MicroPoint p) {
  bool inside = false;
  for (const auto& path : to_clipper(a)) {
    const int where = ClipperLib::PointInPolygon({p.x_um, p.y_um}, path);
    if (where == -1) return true;
    if (where == 1) inside = !inside;
  }
  return inside;
}

bool contains_path(const MicroArea& a, const std::vector<MicroPoint>& path) {
  if (a.empty()) return path.empty();  // Clipper gives nothing of an open path where nothing is taken away
  ClipperLib::Path open;
  open.reserve(path.size());
  for (const MicroPoint& p : path) open.emplace_back(p.x_um, p.y_um);
  ClipperLib::Clipper clipper;
  // A path of less than two different points is none to Clipper.
  if (!clipper.AddPath(open, ClipperLib::ptSubject, false)) return path.empty() || contains(a, path.front());
  clipper.AddPaths(to_clipper(a), ClipperLib::ptClip, true);
  ClipperLib::PolyTree outside;
  clipper.Execute(ClipperLib::ctDifference, outside, ClipperLib::pftEvenOdd, ClipperLib::pftEvenOdd);
  return outside.Total() == 0;
}

}  // namespace veneer::micro
