#include "planner/matching/free_wood.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "planner/matching/banded_polygon.h"

namespace veneer::planner {
namespace {

struct MmVector {
  double x, y;
};

MmVector between(const Point<PanelFrame>& a, const Point<PanelFrame>& b) {
  return {(b.x - a.x).count(), (b.y - a.y).count()};
}

double dot(const MmVector& v, const Point<PanelFrame>& p) { return v.x * p.x.count() + v.y * p.y.count(); }

// Whether a side of `a` has all of `b` on its outer side.
bool separated_by_a_side(const Ring<PanelFrame>& a, const Ring<PanelFrame>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const MmVector along = between(a[i], a[(i + 1) % a.size()]);
    const MmVector outwards{along.y, -along.x};
    const double reach = dot(outwards, a[i]);
    if (std::all_of(b.begin(), b.end(), [&](const auto& p) { return dot(outwards, p) >= reach; })) return true;
  }
  return false;
}

Box<PanelFrame> bounds_of(const std::vector<Ring<PanelFrame>>& rings) {
  Box<PanelFrame> box;
  for (const Ring<PanelFrame>& ring : rings)
    for (const Point<PanelFrame>& p : ring) box.add(p);
  return box;
}

}  // namespace

Ring<PanelFrame> grown(const Ring<PanelFrame>& outline, Millimetres by) {
  // Each corner is where its two moved sides meet: p + by * (n1 + n2) / (1 + n1 . n2), with n outward unit normals.
  Ring<PanelFrame> out;
  out.reserve(outline.size());
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const MmVector in = between(outline[(i + n - 1) % n], outline[i]);
    const MmVector on = between(outline[i], outline[(i + 1) % n]);
    const double in_length = std::hypot(in.x, in.y), on_length = std::hypot(on.x, on.y);
    const MmVector n1{in.y / in_length, -in.x / in_length}, n2{on.y / on_length, -on.x / on_length};
    const double k = by.count() / (1 + n1.x * n2.x + n1.y * n2.y);
    out.push_back({outline[i].x + Millimetres(k * (n1.x + n2.x)), outline[i].y + Millimetres(k * (n1.y + n2.y))});
  }
  return out;
}

std::vector<Ring<PanelFrame>> grown_rings(const Ring<PanelFrame>& outline, Millimetres by) {
  if (is_convex(outline)) return {grown(outline, by)};
  return offset(Region<PanelFrame>(outline), by).rings();
}

bool convex_overlap(const Ring<PanelFrame>& a, const Ring<PanelFrame>& b) {
  return !separated_by_a_side(a, b) && !separated_by_a_side(b, a);
}

FreeWood::FreeWood(const Raster<PanelFrame>& free, Millimetres kerf, Millimetres position_margin)
    : free_(free), kerf_(kerf), margin_(position_margin) {}

FreeWood FreeWood::untouched() const {
  FreeWood wood = *this;
  wood.allocations_.resize(settled_);
  return wood;
}

bool FreeWood::any_blocked(int row, int first, int last) const {
  const auto count = static_cast<std::size_t>(last - first + 1);
  return std::memchr(free_.pixels.ptr<std::uint8_t>(row) + first, 0, count) != nullptr;
}

bool FreeWood::on_free_pixels(const Ring<PanelFrame>& outline) const {
  if (is_convex(outline)) return touches_only_free({grown(outline, border())});
  // Most places fail without the kerf too, which is found sooner.
  return touches_only_free({outline}) && touches_only_free(grown_rings(outline, border()));
}

bool FreeWood::touches_only_free(const std::vector<Ring<PanelFrame>>& rings) const {
  std::vector<BandedPolygon::Corners> corners;
  for (const Ring<PanelFrame>& ring : rings) {
    BandedPolygon::Corners& it = corners.emplace_back();
    it.x.resize(ring.size()), it.y.resize(ring.size());
    for (std::size_t i = 0; i < ring.size(); ++i) free_.to_pixels(ring[i], it.x[i], it.y[i]);
  }
  const BandedPolygon shape(std::move(corners));
  const int columns = free_.pixels.cols, rows = free_.pixels.rows;
  if (shape.top() < 0 || shape.bottom() > rows || shape.left() < 0 || shape.right() > columns) return false;

  // A shape touches exactly those squares of a row of pixels that its part within that row covers.
  const int first_row = static_cast<int>(std::floor(shape.top()));
  const int last_row = std::min(static_cast<int>(std::ceil(shape.bottom())), rows) - 1;
  for (int row = first_row; row <= last_row; ++row) {
    for (const auto& [low, high] : shape.within(row, row + 1)) {
      const int first = std::clamp(static_cast<int>(std::floor(low)), 0, columns - 1);
      const int last = std::clamp(static_cast<int>(std::ceil(high)) - 1, first, columns - 1);
      if (any_blocked(row, first, last)) return false;
    }
  }
  return true;
}

bool FreeWood::collides(const Ring<PanelFrame>& outline) const { return collides_with(outline, allocations_.size()); }

// With the first `count` allocations.
bool FreeWood::collides_with(const Ring<PanelFrame>& outline, std::size_t count) const {
  if (count == 0) return false;
  const bool convex = is_convex(outline);
  const std::vector<Ring<PanelFrame>> mine = grown_rings(outline, kerf_ + kSlack);
  const Box<PanelFrame> box = bounds_of(mine);
  Region<PanelFrame> region, wide;  // grown by the kerf; and by the slack
  for (const Allocation& other : std::span(allocations_).first(count)) {
    if (other.box.min.x > box.max.x || box.min.x > other.box.max.x || other.box.min.y > box.max.y ||
        box.min.y > other.box.max.y)
      continue;
    if (!convex || !other.convex) {
      if (wide.empty()) wide = offset(Region<PanelFrame>(outline), kerf_ + kSlack);
      if (!intersect(wide, other.region).empty()) return true;
      continue;
    }
    if (convex_overlap(mine.front(), other.grown.front())) return true;
    // The ledger's own question, for what lies close enough to be asked.
    if (region.empty()) region = offset(Region<PanelFrame>(outline), kerf_);
    if (overlaps(region, other.region)) return true;
  }
  return false;
}

bool FreeWood::on_free_wood(const Ring<PanelFrame>& outline) const {
  return on_free_pixels(outline) && !collides_with_settled(outline);
}

bool FreeWood::admits(const Ring<PanelFrame>& outline) const { return on_free_pixels(outline) && !collides(outline); }

bool FreeWood::admits_again(const Ring<PanelFrame>& outline) const {
  if (!on_free_pixels(outline)) return false;
  const Region<PanelFrame> region = offset(Region<PanelFrame>(outline), kerf_);
  return std::ranges::none_of(allocations_, [&](const Allocation& other) { return overlaps(region, other.region); });
}

void FreeWood::allocate(const Ring<PanelFrame>& outline) {
  Allocation allocation;
  allocation.convex = is_convex(outline);
  allocation.grown = grown_rings(outline, kerf_);
  allocation.box = bounds_of(allocation.grown);
  allocation.region = offset(Region<PanelFrame>(outline), kerf_);
  allocations_.push_back(std::move(allocation));
}

}  // namespace veneer::planner
