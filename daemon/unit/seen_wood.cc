#include "daemon/unit/seen_wood.h"

#include <fmt/format.h>

#include <map>

#include "base/polygon_ops.h"

namespace veneer::daemon {

Status check_wood_is_there(Repositories& repositories, const std::vector<db::PieceRecord>& pieces) {
  std::map<PanelId, std::vector<const db::PieceRecord*>> by_panel;
  for (const auto& piece : pieces)
    if (piece.state == db::PieceState::kReserved && piece.panel) by_panel[*piece.panel].push_back(&piece);
  for (const auto& [panel, reserved] : by_panel) {
    if (Status seen = repositories.panels.check_seen(panel); !seen) return seen;
    const auto differences = repositories.differences.of(panel);
    if (!differences) return differences.error();
    for (const auto& difference : *differences) {
      if (!difference.gone || difference.decision) continue;
      for (const auto* piece : reserved)
        if (overlaps(Region<PanelFrame>(piece->panel_outline), difference.shape))
          return Error{
              ErrorCode::kRefused,
              fmt::format("a scan found wood gone where piece {0} of job {1} is to be cut from panel {2}: look "
                          "there, then `veneerctl panel decide {2} {3} written-off`, or `... accepted` when the "
                          "wood is whole",
                          piece->mark, piece->job.value, panel.value, difference.id.value)};
    }
  }
  return Ok();
}

Status check_drawn_pieces(Repositories& repositories, const std::vector<db::PieceRecord>& drawn) {
  for (const auto& piece : drawn) {
    const auto now = repositories.jobs.find_piece(piece.id);
    if (!now) return now.error();
    if (now->state == db::PieceState::kReserved && now->allocation == piece.allocation) continue;
    return Error{
        ErrorCode::kRefused,
        fmt::format("piece {} of job {} is {} since its cuts were drawn: Stop and Reset the cell, then Start "
                    "the job again",
                    piece.mark, piece.job.value,
                    now->state == db::PieceState::kReserved ? "to be cut from other wood" : db::to_string(now->state))};
  }
  return check_wood_is_there(repositories, drawn);
}

}  // namespace veneer::daemon
