// Shapes as the schema stores them: text, whole micrometres. "[[0,0],[10,0],[10,10]]" is a ring or a list of points. An
// area is "~0,0 10,0 0,10": its rings, parted by semicolons, each with its first point and the way from each point to
// the next. Before schema 14 it was a list of rings, "[[[0,0],[10,0],[10,10]]]", and is read as that, too.
// Private to db. Pure functions; thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/geometry.h"
#include "base/polygon_ops.h"

namespace veneer::db {

std::string write_ring(const MicroRing& ring);
std::string write_area(const MicroArea& area);
// Empty when the text is not exactly such a shape, or lies farther than 1 km out.
std::optional<MicroRing> read_ring(std::string_view text);
std::optional<MicroArea> read_area(std::string_view text);

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
