#include "planner/poses/footprint.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <tuple>

#include "planner/matching/banded_polygon.h"
#include "planner/matching/free_wood.h"

namespace veneer::planner {

namespace {

struct Vertex {
  double x, y;
};

double cross(const Vertex& a, const Vertex& b, const Vertex& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

double distance_to(const Vertex& p, const Vertex& a, const Vertex& b) {
  const double ux = b.x - a.x, uy = b.y - a.y, squared = ux * ux + uy * uy;
  const double t = squared > 0 ? std::clamp(((p.x - a.x) * ux + (p.y - a.y) * uy) / squared, 0.0, 1.0) : 0;
  return std::hypot(p.x - a.x - t * ux, p.y - a.y - t * uy);
}

// Ramer, Douglas and Peucker: the corners between two that a path within `tolerance` needs.
void simplify(const std::vector<Vertex>& path, std::size_t from, std::size_t to, double tolerance,
              std::vector<Vertex>& out) {
  std::size_t farthest = from;
  double most = tolerance;
  for (std::size_t i = from + 1; i < to; ++i)
    if (const double d = distance_to(path[i], path[from], path[to]); d > most) most = d, farthest = i;
  if (farthest == from) return;
  simplify(path, from, farthest, tolerance, out);
  out.push_back(path[farthest]);
  simplify(path, farthest, to, tolerance, out);
}

std::vector<Vertex> simplified(const Ring<PanelFrame>& ring, double tolerance) {
  std::vector<Vertex> path;
  for (const auto& p : ring) path.push_back({p.x.count(), p.y.count()});
  path.push_back(path.front());
  const std::size_t half = ring.size() / 2;
  std::vector<Vertex> out{path.front()};
  simplify(path, 0, half, tolerance, out);
  out.push_back(path[half]);
  simplify(path, half, path.size() - 1, tolerance, out);
  return out;
}

using CornerNumbers = std::vector<std::size_t>;

bool is_ear(const std::vector<Vertex>& all, const CornerNumbers& left, std::size_t i) {
  const std::size_t n = left.size();
  const Vertex &a = all[left[(i + n - 1) % n]], &b = all[left[i]], &c = all[left[(i + 1) % n]];
  if (cross(a, b, c) <= 0) return false;
  for (std::size_t k = 0; k < n; ++k) {
    if (k == i || k == (i + 1) % n || k == (i + n - 1) % n) continue;
    const Vertex& p = all[left[k]];
    if (cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0) return false;
  }
  return true;
}

// Two convex polygons that share the edge from a to b (of the first one), as one if it is convex.
std::optional<CornerNumbers> joined(const std::vector<Vertex>& all, const CornerNumbers& first,
                                    const CornerNumbers& second) {
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t k = 0; k < second.size(); ++k) {
      if (first[i] != second[(k + 1) % second.size()] || first[(i + 1) % first.size()] != second[k]) continue;
      CornerNumbers out;
      for (std::size_t s = 1; s <= first.size(); ++s) out.push_back(first[(i + s) % first.size()]);
      for (std::size_t s = 2; s < second.size(); ++s) out.push_back(second[(k + s) % second.size()]);
      for (std::size_t s = 0; s < out.size(); ++s)
        if (cross(all[out[s]], all[out[(s + 1) % out.size()]], all[out[(s + 2) % out.size()]]) < 0) return std::nullopt;
      return out;
    }
  return std::nullopt;
}

// Ears are cut off and joined again as long as what comes of it is convex (Hertel and Mehlhorn 1983). Empty: the ring
// crosses itself.
std::vector<CornerNumbers> convex_parts(const std::vector<Vertex>& ring) {
  CornerNumbers left(ring.size());
  std::iota(left.begin(), left.end(), std::size_t{0});
  std::vector<CornerNumbers> parts;
  while (left.size() > 3) {
    std::size_t ear = 0;
    while (ear < left.size() && !is_ear(ring, left, ear)) ++ear;
    if (ear == left.size()) return {};
    parts.push_back({left[(ear + left.size() - 1) % left.size()], left[ear], left[(ear + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  parts.push_back(left);
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (k == i) continue;
      const std::optional<CornerNumbers> both = joined(ring, parts[i], parts[k]);
      if (!both) continue;
      parts[i] = *both;
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(k));
      i = static_cast<std::size_t>(-1);
      break;
    }
  return parts;
}

bool holds_origin(const Ring<PanelFrame>& ring) {
  bool in = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const double ay = ring[i].y.count(), by = ring[j].y.count(), ax = ring[i].x.count(), bx = ring[j].x.count();
    if ((ay > 0) != (by > 0) && 0 < (bx - ax) * (0 - ay) / (by - ay) + ax) in = !in;
  }
  return in;
}

// Counter-clockwise, with +y up.
Ring<PanelFrame> convex_hull(const Ring<PanelFrame>& ring) {
  std::vector<cv::Point2f> points;
  for (const auto& p : ring) points.emplace_back(static_cast<float>(p.x.count()), static_cast<float>(p.y.count()));
  std::vector<int> corners;
  cv::convexHull(points, corners);
  Ring<PanelFrame> out;
  for (const int i : corners) out.push_back(ring[static_cast<std::size_t>(i)]);
  if (signed_area(out) < 0) std::reverse(out.begin(), out.end());
  return out;
}

}  // namespace

Pose pose_at(int panel, double x, double y, double angle) {
  return {panel, x, y, angle, std::cos(angle), std::sin(angle)};
}

bool cheaper(const Candidate& a, const Candidate& b) {
  return std::tie(a.cost, a.pose.panel, a.pose.y, a.pose.x, a.pose.angle) <
         std::tie(b.cost, b.pose.panel, b.pose.y, b.pose.x, b.pose.angle);
}

Footprint::Footprint(const Ring<ArtworkFrame>& outline, Millimetres growth) {
  const Box<ArtworkFrame> box = bounds(outline);
  centre_ = {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
  // grown() works in PanelFrame; here the outline lies on it unturned.
  Ring<PanelFrame> laid;
  for (const auto& p : outline) laid.push_back({p.x - centre_.x, p.y - centre_.y});
  Ring<PanelFrame> around;
  if (!is_convex(laid)) {
    const auto rings = grown_rings(laid, growth + kConcaveSlack / 2);
    std::vector<Vertex> ring;
    if (rings.size() == 1) ring = simplified(rings.front(), kConcaveSlack.count() / 2);
    for (const CornerNumbers& part : convex_parts(ring)) {
      std::vector<Corner> corners;
      for (const std::size_t i : part) corners.push_back({ring[i].x, ring[i].y});
      parts_.push_back(part_of(corners));
    }
    for (const Vertex& v : ring) around.push_back(point<PanelFrame>(v.x, v.y));
    if (parts_.size() > 1) {
      std::vector<Corner> corners;
      for (const auto& p : convex_hull(around)) corners.push_back({p.x.count(), p.y.count()});
      hull_ = part_of(corners);
    }
    if (parts_.empty()) laid = convex_hull(laid);  // its notches close, or it has holes
  }
  if (parts_.empty()) {
    around = grown(laid, growth);
    std::vector<Corner> corners;
    for (const auto& p : around) corners.push_back({p.x.count(), p.y.count()});
    parts_.push_back(part_of(corners));
    inner_ = std::numeric_limits<double>::infinity();
    for (const Side& side : parts_.front().sides) inner_ = std::min(inner_, side.reach);
  } else if (holds_origin(around)) {
    inner_ = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < around.size(); ++i) {
      const auto &a = around[i], &b = around[(i + 1) % around.size()];
      inner_ = std::min(inner_, distance_to({0, 0}, {a.x.count(), a.y.count()}, {b.x.count(), b.y.count()}));
    }
  }
  for (const auto& p : around) outer_ = std::max(outer_, std::hypot(p.x.count(), p.y.count()));
  if (parts_.size() == 1) hull_ = parts_.front();
}

Footprint::Part Footprint::part_of(const std::vector<Corner>& corners) {
  Part part{corners, {}, {}, 0};
  Corner low = corners.front(), high = low;
  for (const Corner& it : corners) {
    low = {std::min(low.x, it.x), std::min(low.y, it.y)};
    high = {std::max(high.x, it.x), std::max(high.y, it.y)};
  }
  part.middle = {(low.x + high.x) / 2, (low.y + high.y) / 2};
  for (const Corner& it : corners)
    part.radius = std::max(part.radius, std::hypot(it.x - part.middle.x, it.y - part.middle.y));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner &from = corners[i], &to = corners[(i + 1) % corners.size()];
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    const Side side{(to.y - from.y) / length, (from.x - to.x) / length, 0};
    part.sides.push_back({side.x, side.y, side.x * from.x + side.y * from.y});
  }
  return part;
}

Isometry2<PanelFrame, ArtworkFrame> Footprint::panel_from_artwork(const Pose& pose) const {
  const double x = centre_.x.count(), y = centre_.y.count();
  return {Radians(pose.angle),
          point<PanelFrame>(pose.x - (pose.cos * x - pose.sin * y), pose.y - (pose.sin * x + pose.cos * y))};
}

Pose Footprint::pose_of(int panel, const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork) const {
  const Point<PanelFrame> at = panel_from_artwork * centre_;
  return pose_at(panel, at.x.count(), at.y.count(), panel_from_artwork.angle().count());
}

// In the frame of `a`.
bool Footprint::separated(const Part& a, const Pose& at_a, const Part& b, const Pose& at_b, double by) {
  const double dx = at_b.x - at_a.x, dy = at_b.y - at_a.y;
  const double shift_x = at_a.cos * dx + at_a.sin * dy, shift_y = at_a.cos * dy - at_a.sin * dx;
  const double cos = at_a.cos * at_b.cos + at_a.sin * at_b.sin, sin = at_a.cos * at_b.sin - at_a.sin * at_b.cos;
  for (const Side& side : a.sides) {
    // The normal as `b` sees it.
    const double nx = side.x * cos + side.y * sin, ny = side.y * cos - side.x * sin;
    const double reach = side.reach - side.x * shift_x - side.y * shift_y + by;
    if (std::all_of(b.corners.begin(), b.corners.end(),
                    [&](const Corner& corner) { return nx * corner.x + ny * corner.y >= reach; }))
      return true;
  }
  return false;
}

bool Footprint::overlap(const Footprint& a, const Pose& at_a, const Footprint& b, const Pose& at_b) {
  if (at_a.panel != at_b.panel) return false;
  const double dx = at_b.x - at_a.x, dy = at_b.y - at_a.y, square = dx * dx + dy * dy;
  const double far = a.outer_ + b.outer_, near = a.inner_ + b.inner_;
  if (square >= far * far) return false;
  if (square < near * near) return true;
  if (a.parts_.size() == 1 && b.parts_.size() == 1)
    return !separated(a.hull_, at_a, b.hull_, at_b) && !separated(b.hull_, at_b, a.hull_, at_a);
  // Most that come so near are parted by their hulls, and most parts of others by the circles around them.
  constexpr double kClearly = 1e-4;  // what rounding cannot make of a touch; a hull's corners are chosen among floats
  if (separated(a.hull_, at_a, b.hull_, at_b, kClearly) || separated(b.hull_, at_b, a.hull_, at_a, kClearly))
    return false;
  const auto middle = [](const Part& part, const Pose& at) {
    return Corner{at.x + at.cos * part.middle.x - at.sin * part.middle.y,
                  at.y + at.sin * part.middle.x + at.cos * part.middle.y};
  };
  for (const Part& part : a.parts_) {
    const Corner here = middle(part, at_a);
    const double from_x = here.x - at_b.x, from_y = here.y - at_b.y, far_enough = b.outer_ + part.radius + kClearly;
    if (from_x * from_x + from_y * from_y > far_enough * far_enough) continue;
    for (const Part& other : b.parts_) {
      const Corner there = middle(other, at_b);
      const double x = there.x - here.x, y = there.y - here.y, reach = part.radius + other.radius + kClearly;
      if (x * x + y * y > reach * reach) continue;
      if (!separated(part, at_a, other, at_b) && !separated(other, at_b, part, at_a)) return true;
    }
  }
  return false;
}

}  // namespace veneer::planner
