// Joins the tiles of one face into one rigid frame by what they share. Internal to registration. Thread-safe.
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

struct JoinLimits {
  // A tag that one tile shows farther from where what else they share puts it (rms of its corners) is not seen alike.
  Millimetres max_offset{0.05};
};

struct Join {
  // Of a tag that two tiles do not show alike while all else that they share agrees: something lies on its rim in one
  // of them.
  struct UnlikeTag {
    int tag = -1;
    std::size_t tile = 0;  // the later of the two
    Millimetres off{0};    // rms of its corners
  };
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
  std::vector<UnlikeTag> unlike;  // and left out of all of the above, on every tile
};

// Tag corners of a tile on the glass, by key.
std::map<int, Point<GlassFrame>> corners_on_glass(const TileView& tile, const ScannerModel& scanner);

// kRefused when a tile shares fewer than two fiducials with the others. What is left out leaves three fiducials and
// twice as many as it is. A tag whose corners keep their shape is never left out, wherever it lies: then the tile is
// displaced, or the tag came loose between the scans, and rms and max say by how much.
Result<Join> join_tiles(std::span<const TileView> tiles, const ScannerModel& scanner, const JoinLimits& limits = {});

}  // namespace veneer::calib
