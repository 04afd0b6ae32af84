// From pieces on the bed to strokes of the beam, in BedFrame. `daemon` applies machine_from_bed and hands them to a
// driver.
//
// Per piece: its mark first, then the cuts of its holes, then its outline; all strokes of a piece are adjacent. The
// beam runs on the outline grown by half a kerf (corners mitred, as base/polygon_ops says), holes shrunk by the same.
// Deterministic. Pure functions; thread-safe.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "planner/marks.h"
#include "planner/recipe.h"

namespace veneer::planner {

struct ToolpathPiece {
  PieceId piece;
  Ring<BedFrame> outline;             // of the finished piece; either direction
  std::vector<Ring<BedFrame>> holes;  // cut out of the piece
  std::string mark;                   // "" = none
  Radians artwork_up{kPi / 2};        // where the artwork's up points in BedFrame, counter-clockwise from +x
};

enum class ToolpathRole { kEngrave, kCut };

struct ToolpathStroke {
  PieceId piece;
  ToolpathRole role = ToolpathRole::kCut;
  Polyline<BedFrame> path;  // a closed path repeats its first point at the end
  bool closed = false;
};

struct ToolpathOptions {
  Recipe recipe;
  MarkOptions marks;
  Kinematics kinematics;
  Point<BedFrame> start{};  // where the head is before the first stroke
};

struct Toolpath {
  std::vector<ToolpathStroke> strokes;  // in the order of burning
  std::vector<PieceId> order;           // pieces in the order of burning
  std::vector<std::string> warnings;    // one sentence for each mark that was left out
  Millimetres burnt{0};                 // length with the beam on
  Millimetres travel{0};                // length with the beam off
  std::chrono::duration<double> estimate{0};
};

// kInvalidArgument when an outline is degenerate, is no single area, or the kerf closes it.
Result<Toolpath> make_toolpath(const std::vector<ToolpathPiece>& pieces, const ToolpathOptions& options);

}  // namespace veneer::planner
