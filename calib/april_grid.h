// The cell's metric standard: a sheet of 12 x 10 AprilTags (36h11, ids 0..119), precise to 5 um.
//
// SheetFrame: mm on the printed face, seen from that face, +x along a row, +y towards the upper rows, origin at the
// lower left corner of tag 0's black square. Ids run row by row from the lower left.
#pragma once

#include <array>

#include "base/geometry.h"

namespace veneer {

struct SheetFrame {  // mm on a calibration sheet's printed face
  using Length = Millimetres;
};

namespace calib {

struct AprilGrid {
  int columns = 12;
  int rows = 10;
  Millimetres tag_size{18};  // black square
  Millimetres pitch{24};
  int first_id = 0;

  int tags() const { return columns * rows; }
  bool has(int id) const { return id >= first_id && id < first_id + tags(); }
  // In the order of Tag::corners (lower left, lower right, upper right, upper left); `id` must be the grid's.
  std::array<Point<SheetFrame>, 4> corners(int id) const {
    const int k = id - first_id;
    const int row = k / columns, column = k % columns;
    const Millimetres x = pitch * column, y = pitch * row;
    return {{{x, y}, {x + tag_size, y}, {x + tag_size, y + tag_size}, {x, y + tag_size}}};
  }
};

}  // namespace calib
}  // namespace veneer
