// The squares by which a place on an assembly map is named, as on a town's: a letter across, a number down. The letter
// is small, so that no square is taken for a mark. Pure.
#pragma once

#include <string>

#include "base/geometry.h"

namespace veneer::planner {

// Millimetres of the artwork as the map shows it, from either side: +x right, +y up, origin at the lower left corner.
struct MapFrame {
  using Length = Millimetres;
};

struct MapSquares {
  Millimetres width, height;  // of the artwork
  int across = 1, down = 1;

  // Some eight along the longer side, nearly square.
  static MapSquares over(Millimetres width, Millimetres height);
  static std::string letter(int column);                   // from 0 at the left; no i, l, o
  std::string square_of(const Point<MapFrame>& at) const;  // "c4"
};

}  // namespace veneer::planner
