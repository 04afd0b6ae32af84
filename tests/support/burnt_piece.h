// A piece as the planner has it burnt, without a mark: its kerf, its lead-in, the run past the beginning.
#pragma once

#include "daemon/unit/piece_burn.h"
#include "planner/cutting/toolpath.h"

namespace veneer::testing {

// The laser's travel begins somewhere beside the panel's corner.
inline Result<daemon::PieceBurn> burnt_piece(PieceId id, const Ring<PanelFrame>& outline) {
  planner::ToolpathPiece piece;
  piece.piece = id;
  for (const auto& p : outline) piece.outline.push_back(point<BedFrame>(p.x.count() + 40.1234, p.y.count() + 30.4321));
  const auto& corner = piece.outline.front();
  piece.leads = {{point<BedFrame>(corner.x.count() + 0.8, corner.y.count()), corner}};
  const auto made = planner::make_toolpath({piece}, {});
  if (!made) return made.error();
  daemon::PieceBurn out{id, "A1", {}, 0};
  for (const auto& stroke : made->strokes) {
    Stroke& cut = out.strokes.strokes.emplace_back();
    cut.piece = id, cut.role = stroke.role, cut.speed = stroke.speed, cut.power = stroke.power;
    cut.passes = stroke.passes, cut.air = stroke.air, cut.overscan = stroke.overscan;
    for (const auto& p : stroke.path) cut.path.push_back(point<MachineFrame>(p.x.count(), p.y.count()));
  }
  return out;
}

}  // namespace veneer::testing
