// Boolean and offset operations on an integer micrometre grid: the ledger's truth and the kerf's arithmetic.
//
// A Region is a set of polygons with holes whose vertices are whole micrometres; operations on equal inputs give equal
// outputs, bit for bit. Coordinates must stay within +-1 000 m. The only user of Clipper is polygon_ops.cc.
// Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.h"

namespace veneer {

struct MicroPoint {
  std::int64_t x_um = 0, y_um = 0;
  friend bool operator==(const MicroPoint&, const MicroPoint&) = default;
};
using MicroRing = std::vector<MicroPoint>;

// Rings of one non-overlapping area under the even-odd rule: outer rings counter-clockwise, holes clockwise.
struct MicroArea {
  std::vector<MicroRing> rings;
  bool empty() const { return rings.empty(); }
};

struct MicroBox {
  MicroPoint min, max;
};

namespace micro {
MicroArea unite(const MicroArea& a, const MicroArea& b);
MicroArea unite(const std::vector<MicroArea>& areas);
MicroArea subtract(const MicroArea& a, const MicroArea& b);
MicroArea intersect(const MicroArea& a, const MicroArea& b);
// Grows (positive) or shrinks by `delta_um`. Corners are mitred up to a limit of 2, `round` corners are arcs within 5
// um.
MicroArea offset(const MicroArea& a, double delta_um, bool round);
double area_um2(const MicroArea& a);
// Of an area that is empty its corners lie the wrong way round.
MicroBox box_of(const MicroArea& a);
// Whether the boxes of both share more than touching borders: cheap, and areas that overlap always do.
bool boxes_overlap(const MicroArea& a, const MicroArea& b);
std::size_t corners_of(const MicroArea& a);
bool contains(const MicroArea& a, MicroPoint p);  // boundary counts as inside
// Whether the path stays inside, between its points too. What runs along the border may count as outside.
bool contains_path(const MicroArea& a, const std::vector<MicroPoint>& path);
}  // namespace micro

// A MicroArea that knows its frame.
template <class Frame>
class Region {
  static_assert(std::is_same_v<typename Frame::Length, Millimetres>, "regions live in millimetre frames");

 public:
  Region() = default;
  explicit Region(MicroArea area) : area_(std::move(area)) {}
  // Rounds to whole micrometres; either direction of the ring is accepted.
  explicit Region(const Ring<Frame>& outline) {
    MicroRing ring;
    ring.reserve(outline.size());
    for (const auto& p : outline) ring.push_back(to_micrometres(p));
    area_ = micro::unite(MicroArea{{std::move(ring)}}, {});
  }

  const MicroArea& micro_area() const { return area_; }
  bool empty() const { return area_.empty(); }
  SquareMillimetres area() const { return SquareMillimetres(micro::area_um2(area_) * 1e-6); }
  // REQUIRES: it is not empty.
  Box<Frame> box() const {
    const MicroBox box = micro::box_of(area_);
    return {from_micrometres(box.min), from_micrometres(box.max)};
  }
  bool contains(const Point<Frame>& p) const { return micro::contains(area_, to_micrometres(p)); }
  // The whole path, not only its points; it is rounded to whole micrometres.
  bool contains(const Polyline<Frame>& path) const {
    std::vector<MicroPoint> rounded;
    rounded.reserve(path.size());
    for (const auto& p : path) rounded.push_back(to_micrometres(p));
    return micro::contains_path(area_, rounded);
  }
  std::vector<Ring<Frame>> rings() const {
    std::vector<Ring<Frame>> out;
    for (const auto& ring : area_.rings) {
      Ring<Frame>& r = out.emplace_back();
      for (const auto& p : ring) r.push_back(from_micrometres(p));
    }
    return out;
  }

 private:
  static MicroPoint to_micrometres(const Point<Frame>& p) {
    return {std::llround(p.x.count() * 1000), std::llround(p.y.count() * 1000)};
  }
  static Point<Frame> from_micrometres(const MicroPoint& p) {
    return point<Frame>(static_cast<double>(p.x_um) / 1000, static_cast<double>(p.y_um) / 1000);
  }

  MicroArea area_;
};

template <class Frame>
Region<Frame> unite(const Region<Frame>& a, const Region<Frame>& b) {
  return Region<Frame>(micro::unite(a.micro_area(), b.micro_area()));
}
template <class Frame>
Region<Frame> unite(const std::vector<Region<Frame>>& all) {
  std::vector<MicroArea> areas;
  areas.reserve(all.size());
  for (const auto& r : all) areas.push_back(r.micro_area());
  return Region<Frame>(micro::unite(areas));
}
template <class Frame>
Region<Frame> subtract(const Region<Frame>& a, const Region<Frame>& b) {
  return Region<Frame>(micro::subtract(a.micro_area(), b.micro_area()));
}
template <class Frame>
Region<Frame> intersect(const Region<Frame>& a, const Region<Frame>& b) {
  return Region<Frame>(micro::intersect(a.micro_area(), b.micro_area()));
}
enum class Corners { kMitred, kRound };
template <class Frame>
Region<Frame> offset(const Region<Frame>& a, Millimetres by, Corners corners = Corners::kMitred) {
  return Region<Frame>(micro::offset(a.micro_area(), by.count() * 1000, corners == Corners::kRound));
}
// Whether the two share more than touching borders. Slivers under `slack` square millimetres are rounding, not overlap.
template <class Frame>
bool overlaps(const Region<Frame>& a, const Region<Frame>& b, SquareMillimetres slack = SquareMillimetres(1e-4)) {
  return micro::boxes_overlap(a.micro_area(), b.micro_area()) &&
         micro::area_um2(micro::intersect(a.micro_area(), b.micro_area())) * 1e-6 > slack.count();
}

}  // namespace veneer
