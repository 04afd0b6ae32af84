// From a path to steps of the board: 1 mil = 0.001 inch = 25.4 um, in x, in y or in both at once.
//
// Board coordinates count mils from the home corner at the upper left, +x right, +y down (towards the operator).
// The steps follow the path itself, not its rounded corners, so errors never add up: every place of the stepped path
// lies within half a mil of the path in x and in y, and every place of the path within half a mil of the stepped one.
//
// Pure functions; thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/geometry.h"

namespace veneer::lihuiyu {

inline constexpr double kMillimetresPerMil = 0.0254;

struct MilPoint {
  std::int64_t x = 0, y = 0;
  friend bool operator==(const MilPoint&, const MilPoint&) = default;
};

// `length` steps of (dx, dy), each of -1, 0 or 1 and not both 0.
struct StepRun {
  int dx = 0, dy = 0;
  std::int64_t length = 0;
  friend bool operator==(const StepRun&, const StepRun&) = default;
};

// Where the machine's millimetres lie on the board.
struct MilGrid {
  double travel_x_mm = 0, travel_y_mm = 0;

  // Unrounded mils.
  std::pair<double, double> to_board(const Point<MachineFrame>& p) const {
    return {p.x.count() / kMillimetresPerMil, (travel_y_mm - p.y.count()) / kMillimetresPerMil};
  }
  MilPoint nearest(const Point<MachineFrame>& p) const;
  Point<MachineFrame> from_board(MilPoint p) const;
};

// The runs along a path, from the mil nearest to its first point to the one nearest to its last.
std::vector<StepRun> runs_along(const Polyline<MachineFrame>& path, const MilGrid& grid);

// The shortest runs between two places; what lies between does not matter. One diagonal, one straight.
std::vector<StepRun> runs_between(MilPoint from, MilPoint to);

}  // namespace veneer::lihuiyu
