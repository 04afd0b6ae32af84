// Finds the circular arcs in a path of many short lines, on the integer micrometre grid.
//
// Pure functions; thread-safe.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/polygon_ops.h"

namespace veneer {

struct ArcShape {
  MicroPoint centre;
  bool clockwise = false;
};

// One move from the end of the one before.
struct PathMove {
  MicroPoint to;
  std::optional<ArcShape> arc;  // without: straight
  std::size_t lines = 1;        // of the path that it stands for
};

struct ArcFitOptions {
  double tolerance_um = 7;      // from the given lines to the arc and back
  double end_tolerance_um = 3;  // between the arc's radius at its begin and at its end
  double largest_radius_um = 20000;
  double longest_turn_rad = 2.96;  // less than half a turn
};

// The moves from path.front() to path.back(). Every arc replaces at least three lines and begins and ends at points of
// the path; straight moves are the path's own lines.
std::vector<PathMove> fit_arcs(std::span<const MicroPoint> path, const ArcFitOptions& options = {});

// One arc for the whole path of at least three lines, if there is one.
std::optional<ArcShape> fit_arc(std::span<const MicroPoint> path, const ArcFitOptions& options = {});

// How far the arc turns from `from` to `to`; radians, positive.
double arc_turn_rad(MicroPoint from, MicroPoint to, const ArcShape& arc);

}  // namespace veneer
