#include "planner/matching/free_wood.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace veneer::planner {
namespace {

struct Vector {
  double x, y;
};

Vector between(const Point<PanelFrame>& a, const Point<PanelFrame>& b) {
  return {(b.x - a.x).count(), (b.y - a.y).count()};
}

double dot(const Vector& v, const Point<PanelFrame>& p) { return v.x * p.x.count() + v.y * p.y.count(); }

// Whether a side of `a` has all of `b` on its outer side.
bool separated_by_a_side(const Ring<PanelFrame>& a, const Ring<PanelFrame>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vector along = between(a[i], a[(i + 1) % a.size()]);
    const Vector outwards{along.y, -along.x};
    const double reach = dot(outwards, a[i]);
    if (std::all_of(b.begin(), b.end(), [&](const auto& p) { return dot(outwards, p) >= reach; })) return true;
  }
  return false;
}

}  // namespace

Ring<PanelFrame> grown(const Ring<PanelFrame>& outline, Millimetres by) {
  // Each corner is where its two moved sides meet: p + by * (n1 + n2) / (1 + n1 . n2), with n outward unit normals.
  Ring<PanelFrame> out;
  out.reserve(outline.size());
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector in = between(outline[(i + n - 1) % n], outline[i]);
    const Vector on = between(outline[i], outline[(i + 1) % n]);
    const double in_length = std::hypot(in.x, in.y), on_length = std::hypot(on.x, on.y);
    const Vector n1{in.y / in_length, -in.x / in_length}, n2{on.y / on_length, -on.x / on_length};
    const double k = by.count() / (1 + n1.x * n2.x + n1.y * n2.y);
    out.push_back({outline[i].x + Millimetres(k * (n1.x + n2.x)), outline[i].y + Millimetres(k * (n1.y + n2.y))});
  }
  return out;
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
  std::vector<double> x(outline.size()), y(outline.size());
  for (std::size_t i = 0; i < outline.size(); ++i) free_.to_pixels(outline[i], x[i], y[i]);
  const auto [top, bottom] = std::minmax_element(y.begin(), y.end());
  const auto [left, right] = std::minmax_element(x.begin(), x.end());
  if (*top < 0 || *bottom > free_.pixels.rows || *left < 0 || *right > free_.pixels.cols) return false;

  // A convex shape touches exactly those squares of a row of pixels that its part within that row spans.
  const int first_row = static_cast<int>(std::floor(*top));
  const int last_row = std::min(static_cast<int>(std::ceil(*bottom)), free_.pixels.rows) - 1;
  for (int row = first_row; row <= last_row; ++row) {
    double low = 1e300, high = -1e300;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t j = (i + 1) % x.size();
      const double y0 = std::max<double>(std::min(y[i], y[j]), row),
                   y1 = std::min<double>(std::max(y[i], y[j]), row + 1);
      if (y0 > y1) continue;
      const double run = y[j] - y[i];
      for (const double at : {y0, y1}) {
        const double cross = std::abs(run) < 1e-12 ? x[i] : x[i] + (x[j] - x[i]) * ((at - y[i]) / run);
        low = std::min(low, cross), high = std::max(high, cross);
      }
      if (std::abs(run) < 1e-12) low = std::min(low, x[j]), high = std::max(high, x[j]);
    }
    if (low > high) continue;
    const int first = std::clamp(static_cast<int>(std::floor(low)), 0, free_.pixels.cols - 1);
    const int last = std::clamp(static_cast<int>(std::ceil(high)) - 1, first, free_.pixels.cols - 1);
    if (any_blocked(row, first, last)) return false;
  }
  return true;
}

bool FreeWood::collides(const Ring<PanelFrame>& outline) const { return collides_with(outline, allocations_.size()); }

// With the first `count` allocations.
bool FreeWood::collides_with(const Ring<PanelFrame>& outline, std::size_t count) const {
  if (count == 0) return false;
  const Ring<PanelFrame> mine = grown(outline, kerf_ + kSlack);
  const Box<PanelFrame> box = bounds(mine);
  Region<PanelFrame> region;
  for (const Allocation& other : std::span(allocations_).first(count)) {
    if (other.box.min.x > box.max.x || box.min.x > other.box.max.x || other.box.min.y > box.max.y ||
        box.min.y > other.box.max.y)
      continue;
    if (convex_overlap(mine, other.grown)) return true;
    // The ledger's own question, for what lies close enough to be asked.
    if (region.empty()) region = offset(Region<PanelFrame>(outline), kerf_);
    if (overlaps(region, other.region)) return true;
  }
  return false;
}

bool FreeWood::on_free_wood(const Ring<PanelFrame>& outline) const {
  return on_free_pixels(grown(outline, border())) && !collides_with(outline, settled_);
}

bool FreeWood::admits(const Ring<PanelFrame>& outline) const {
  return on_free_pixels(grown(outline, border())) && !collides(outline);
}

void FreeWood::allocate(const Ring<PanelFrame>& outline) {
  Allocation allocation;
  allocation.grown = grown(outline, kerf_);
  allocation.box = bounds(allocation.grown);
  allocation.region = offset(Region<PanelFrame>(outline), kerf_);
  allocations_.push_back(std::move(allocation));
}

}  // namespace veneer::planner
