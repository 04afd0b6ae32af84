// Joins the tiles of one face into one rigid frame by what they share. Internal to registration.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/registration.h"

namespace veneer::calib {

struct JoinedFrame {  // mm; the glass frame of the first tile
  using Length = Millimetres;
};

// A tag corner: tag id * 4 + corner. Holes are numbered from here.
constexpr int kFirstHoleKey = 1 << 20;

struct Join {
  std::vector<Isometry2<JoinedFrame, GlassFrame>> tiles;
  std::map<int, Point<JoinedFrame>> corners;  // by key; means where several tiles see one
  struct JoinedHole {
    Point<JoinedFrame> centre;
    Millimetres diameter{0};
  };
  std::vector<JoinedHole> holes;
  // Disagreement at corners that several tiles share; null with one tile.
  std::optional<Millimetres> rms, max;
  int worst_tag = -1;
};

// Tag corners of a tile on the glass, by key.
std::map<int, Point<GlassFrame>> corners_on_glass(const TileView& tile, const ScannerModel& scanner);

// kRefused when a tile shares fewer than two fiducials with the others.
Result<Join> join_tiles(std::span<const TileView> tiles, const ScannerModel& scanner);

}  // namespace veneer::calib
