// A layout: the planar partition of an artwork into faces. Every layout makes one; what follows knows only it.
//
// An edge is stored once, as cubic Bezier curves one after the other, and used by the two faces beside it, forwards by
// the one on its left, backwards by the one on its right: neighbours share it to the last bit. Control points of curved
// edges are whole micrometres, but for the coordinate that lies on the artwork's own border; straight edges of a grid
// lie where the artwork's size divides. ArtworkFrame. Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/geometry.h"
#include "planner/layout/grid.h"

namespace veneer::planner {

struct PartitionEdge {
  std::vector<Point<ArtworkFrame>> curve;  // 3 n + 1 control points
  // Faces; kOutside: there is none.
  static constexpr std::size_t kOutside = static_cast<std::size_t>(-1);
  std::size_t left = kOutside, right = kOutside;

  std::size_t segments() const { return curve.size() / 3; }
  friend bool operator==(const PartitionEdge&, const PartitionEdge&) = default;
};
PartitionEdge straight_edge(const Point<ArtworkFrame>& from, const Point<ArtworkFrame>& to);

struct DirectedEdge {
  std::size_t edge = 0;
  bool backwards = false;
  friend bool operator==(const DirectedEdge&, const DirectedEdge&) = default;
};

struct PartitionFace {
  std::vector<DirectedEdge> boundary;  // counter-clockwise, each ends where the next one begins
  friend bool operator==(const PartitionFace&, const PartitionFace&) = default;
};

struct Partition {
  Millimetres width, height;
  std::vector<PartitionEdge> edges;
  std::vector<PartitionFace> faces;
  friend bool operator==(const Partition&, const Partition&) = default;
};

inline constexpr Millimetres kFlatness{0.01};  // between a curve and the polygon that stands for it

// The way along an edge, its ends included.
Polyline<ArtworkFrame> flattened(const PartitionEdge& edge);
// The outline of a face, counter-clockwise. Neighbours have the same points along a shared edge; where straight edges
// continue each other, the vertex between them is left out.
Ring<ArtworkFrame> outline_of(const Partition& partition, std::size_t face);

// The same with its faces in this order, all of them.
Partition with_faces(const Partition& partition, std::span<const std::size_t> order);

// The partition that rectangles make, which cover the artwork without gaps and overlaps: a grid, with or without
// T-junctions. Faces are in the order of `patches`.
Partition partition_of(Millimetres width, Millimetres height, std::span<const Patch> patches);

}  // namespace veneer::planner
