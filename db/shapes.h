// Shapes as the schema stores them: text, whole micrometres. "[[0,0],[10,0],[10,10]]" is a ring or a list of points. An
// area is "=", then its rings, parted by semicolons: of each the first point and the way from each point to the next,
// every coordinate in one to seven letters (docs/SCHEMA.md); "~" is an area without wood. An outline of a patch or
// piece is written as an area of one ring. Older schemas wrote such areas as "~0,0 10,0 0,10" and outlines as rings,
// before schema 14 areas as lists of rings, "[[[0,0],[10,0],[10,10]]]"; all of them are read. Private to db. Pure
// functions; thread-safe.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/geometry.h"
#include "base/polygon_ops.h"

namespace veneer::db {

std::string write_ring(const MicroRing& ring);
std::string write_area(const MicroArea& area);
// One ring as an area is written, its points in their order; "~" without any.
std::string write_outline(const MicroRing& ring);
// A ring may be an outline. Empty when the text is not exactly such a shape, or lies farther than 1 km out.
std::optional<MicroRing> read_ring(std::string_view text);
std::optional<MicroArea> read_area(std::string_view text);
std::optional<MicroRing> read_outline(std::string_view text);

// Areas as they are stored, in whole square micrometres.
inline std::int64_t to_um2(SquareMillimetres area) { return std::llround(area.count() * 1e6); }
inline SquareMillimetres from_um2(std::int64_t um2) { return SquareMillimetres(static_cast<double>(um2) / 1e6); }

// The box around an area; the empty box without wood.
template <class Frame>
Box<Frame> bounds_of(const Region<Frame>& area) {
  Box<Frame> box;
  for (const auto& ring : area.rings())
    for (const auto& p : ring) box.add(p);
  return box;
}

template <class Frame>
MicroRing to_micro(const std::vector<Point<Frame>>& points) {
  MicroRing ring;
  ring.reserve(points.size());
  for (const auto& p : points) ring.push_back({std::llround(p.x.count() * 1000), std::llround(p.y.count() * 1000)});
  return ring;
}

template <class Frame>
std::vector<Point<Frame>> from_micro(const MicroRing& ring) {
  std::vector<Point<Frame>> points;
  points.reserve(ring.size());
  for (const auto& p : ring)
    points.push_back(point<Frame>(static_cast<double>(p.x_um) / 1000, static_cast<double>(p.y_um) / 1000));
  return points;
}

}  // namespace veneer::db
