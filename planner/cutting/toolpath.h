// From pieces on the bed to strokes of the beam, in BedFrame. `daemon` applies machine_from_bed and hands them to a
// driver.
//
// Per piece: its mark first, then the cuts of its holes, then its outline; all strokes of a piece are adjacent. Kerf,
// beginnings, lead-ins and bridges are beam_path.h's, the order of the pieces is cut_order.h's, times are
// time_estimate.h's. Deterministic. Pure functions; thread-safe.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "base/stroke.h"
#include "planner/cutting/beam_path.h"
#include "planner/cutting/marks.h"
#include "planner/cutting/recipe.h"
#include "planner/cutting/time_estimate.h"

namespace veneer::planner {

struct ToolpathPiece {
  PieceId piece;
  Ring<BedFrame> outline;             // of the finished piece; either direction
  std::vector<Ring<BedFrame>> holes;  // cut out of the piece
  std::string mark;                   // "" = none
  Radians artwork_up{kPi / 2};        // where the artwork's up points in BedFrame, counter-clockwise from +x
  std::optional<Recipe> recipe;       // of its wood; without, the options' one
  // By which its cut may begin in waste that is booked for it (lead_choice.h). None: on its edge. Wood in the piece's
  // own holes is waste where no other piece lies.
  std::vector<Lead<BedFrame>> leads;
};

struct ToolpathOptions {
  Recipe recipe;
  MarkOptions marks;
  LeadOptions leads;
  BridgeOptions bridges;
  Millimetres fit_clearance{0.05};  // of a joint; each of its two edges gives half
  Millimetres cool_distance{2};     // pieces nearer than this do not follow each other while it can be avoided
  bool assembly_order = false;      // burn the pieces in the order they are given
  Kinematics kinematics;
  Point<BedFrame> start{};  // where the head is before the first stroke
};

// What became of one piece.
struct ToolpathSummary {
  PieceId piece;
  std::size_t strokes = 0;  // how many, in order
  std::size_t bridges = 0;
  std::optional<Point<BedFrame>> lead;        // where its cut begins in waste
  std::chrono::duration<double> estimate{0};  // with the way to it and the drain after it
};

struct Toolpath {
  std::vector<StrokeIn<BedFrame>> strokes;  // in the order of burning
  std::vector<ToolpathSummary> pieces;      // in the order of burning
  std::vector<std::string> warnings;        // one sentence each: a mark left out, a bridge that found no place
  Millimetres burnt{0};                     // length with the beam on
  Millimetres travel{0};                    // length with the beam off
  std::size_t hot_pairs = 0;                // neighbours that could not be kept from following each other
  std::chrono::duration<double> estimate{0};
};

// kInvalidArgument when an outline is degenerate, is no single area, or the kerf closes it.
Result<Toolpath> make_toolpath(const std::vector<ToolpathPiece>& pieces, const ToolpathOptions& options);

}  // namespace veneer::planner
