// The calibration pattern: burnt into a bare board, photographed by the bed camera and laid on the scanner. It ties
// MachineFrame to what the camera sees (axis scale and skew) and gives the kerf.
//
// Geometry, all in MachineFrame:
//  - rings: engraved circles on a lattice that fills `area` up to `margin`, columns x rows, row-major from the lower
//    left, spaced evenly near `pitch`. Diameter (of the middle of the line) 4 mm; three key rings have 8 mm: lattice
//    places (0, 0), (columns - 1, 0) and (1, rows - 1). No turn or mirroring of the lattice maps the keys onto
//    themselves.
//  - kerf lines: straight through-cuts of 20 mm, four parallel to x and four parallel to y, each four unevenly spaced
//    (6, 7 and 8 mm) and at least 5 mm clear of every ring. The x lines lie in the middle lattice cell of the lowest
//    row of cells, the y lines in the cell right of it.
//
// Pure functions; thread-safe.
#pragma once

#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "planner/cutting/recipe.h"

namespace veneer::planner {

struct PatternOptions {
  Box<MachineFrame> area;  // surely covered by the board
  Millimetres pitch{40};
  Millimetres margin{6};  // from the centres of outer rings to the area's edge
};

struct PatternRing {
  Point<MachineFrame> centre;
  Millimetres diameter{4};
};

struct PatternLine {
  Point<MachineFrame> from, to;
  bool along_x = false;
};

struct Pattern {
  int columns = 0, rows = 0;
  std::vector<PatternRing> rings;  // row-major from the lower left
  std::vector<PatternLine> kerf_lines;
};

struct PatternStroke {
  Polyline<MachineFrame> path;
  bool through = false;  // a kerf line, cut through; otherwise engraved
};

// kInvalidArgument when the area is too small for 3 x 3 rings with the kerf lines between them: about 90 x 90 mm.
Result<Pattern> make_pattern(const PatternOptions& options);

// Rings first, kerf lines last, in a short order. Circles are flattened to 2 um.
std::vector<PatternStroke> pattern_strokes(const Pattern& pattern);

}  // namespace veneer::planner
