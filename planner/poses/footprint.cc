#include "planner/poses/footprint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "planner/matching/banded_polygon.h"
#include "planner/matching/free_wood.h"

namespace veneer::planner {

namespace {

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
  if (!is_convex(laid)) laid = convex_hull(laid);
  for (const auto& p : grown(laid, growth)) corners_.push_back({p.x.count(), p.y.count()});
  inner_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Corner &from = corners_[i], &to = corners_[(i + 1) % corners_.size()];
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    const Side side{(to.y - from.y) / length, (from.x - to.x) / length, 0};
    sides_.push_back({side.x, side.y, side.x * from.x + side.y * from.y});
    inner_ = std::min(inner_, sides_.back().reach);
    outer_ = std::max(outer_, std::hypot(from.x, from.y));
  }
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

// Whether a side of `a` has all of `b` on its outer side; in the frame of `a`.
bool Footprint::separated(const Footprint& a, const Pose& at_a, const Footprint& b, const Pose& at_b) {
  const double dx = at_b.x - at_a.x, dy = at_b.y - at_a.y;
  const double shift_x = at_a.cos * dx + at_a.sin * dy, shift_y = at_a.cos * dy - at_a.sin * dx;
  const double cos = at_a.cos * at_b.cos + at_a.sin * at_b.sin, sin = at_a.cos * at_b.sin - at_a.sin * at_b.cos;
  for (const Side& side : a.sides_) {
    // The normal as `b` sees it.
    const double nx = side.x * cos + side.y * sin, ny = side.y * cos - side.x * sin;
    const double reach = side.reach - side.x * shift_x - side.y * shift_y;
    bool outside = true;
    for (const Corner& corner : b.corners_) outside = outside && nx * corner.x + ny * corner.y >= reach;
    if (outside) return true;
  }
  return false;
}

bool Footprint::overlap(const Footprint& a, const Pose& at_a, const Footprint& b, const Pose& at_b) {
  if (at_a.panel != at_b.panel) return false;
  const double dx = at_b.x - at_a.x, dy = at_b.y - at_a.y, square = dx * dx + dy * dy;
  const double far = a.outer_ + b.outer_, near = a.inner_ + b.inner_;
  if (square >= far * far) return false;
  if (square < near * near) return true;
  return !separated(a, at_a, b, at_b) && !separated(b, at_b, a, at_a);
}

}  // namespace veneer::planner
