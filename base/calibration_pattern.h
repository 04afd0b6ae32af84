// The calibration pattern: burnt into a bare board, photographed by the bed camera and laid on the scanner. It ties
// MachineFrame to what the camera sees (axis scale and skew) and shows the kerf.
//
// Rings are engraved circles where columns and rows of a lattice cross. Most have one diameter; at least three key
// rings are clearly larger (1.5 times or more) and placed so that no turn or mirroring of the lattice maps them onto
// themselves. Kerf lines are straight through-cuts, clear of the rings. Coordinates are as commanded.
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

// How far apart its columns and rows are. Rings at equal distances meet a belt that is off at each turn of its pulley
// always at the same phase where they are one turn apart, and nothing then tells of it.
enum class RingSpacing {
  kEven,    // some 40 mm, one turn of a pulley with 20 teeth on a belt of 2 mm; as patterns were burnt before
  kUneven,  // 14 mm and more; no turn of a pulley of 30 to 52 mm fits all of them
};

// The axes follow from rings that span more than this along x and along y.
constexpr Millimetres kLeastRingSpan{80};

// What a pattern is made of, and made of again to read what was burnt.
struct PatternLayout {
  Box<MachineFrame> area;  // surely covered by the board
  RingSpacing spacing = RingSpacing::kUneven;
};

struct CalibrationPattern {
  int columns = 0, rows = 0;
  std::vector<PatternRing> rings;  // row-major from the lower left
  std::vector<KerfLine> kerf_lines;
};

}  // namespace veneer
