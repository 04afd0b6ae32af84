// The beam's path as other programs draw it: straight lines, and cubic Bezier curves where it was a curve before it was
// flattened. Pure; thread-safe.
#pragma once

#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

inline constexpr Millimetres kCurveFit{0.01};  // between the curves and the path

// From where the one before ends (the first: the path's first point) to `to`.
struct PathSegment {
  bool curved = false;
  Point<BedFrame> first, second;  // controls; of a straight one a third and two thirds of the way
  Point<BedFrame> to;
};

// `closed`: the path's last point is joined to its first. Corners, and the beginning, stay where they are.
std::vector<PathSegment> segments_of(const Polyline<BedFrame>& path, bool closed);
bool has_curves(const std::vector<PathSegment>& segments);

}  // namespace veneer::planner
