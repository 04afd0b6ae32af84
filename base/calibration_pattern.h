// The calibration pattern: burnt into a bare board, photographed by the bed camera and laid on the scanner. It ties
// MachineFrame to what the camera sees (axis scale and skew) and shows the kerf.
//
// Rings are engraved circles on a lattice. Most have one diameter; at least three key rings are clearly larger (1.5
// times or more) and placed so that no turn or mirroring of the lattice maps them onto themselves. Kerf lines are
// straight through-cuts, clear of the rings. Coordinates are as commanded.
#pragma once

#include <vector>

#include "base/geometry.h"

namespace veneer {

struct PatternRing {
  Point<MachineFrame> centre;
  Millimetres diameter{4};  // of the middle of the burnt line
};

// Burnt in one pass at the cutting recipe; at least 10 mm long, 3 mm clear of other burns.
struct KerfLine {
  Point<MachineFrame> from, to;
};

struct CalibrationPattern {
  int columns = 0, rows = 0;
  std::vector<PatternRing> rings;  // row-major from the lower left
  std::vector<KerfLine> kerf_lines;
};

}  // namespace veneer
