#include "daemon/stock/suspect_sightings.h"

#include <algorithm>

#include "daemon/orders/scan_doubts.h"

namespace veneer::daemon {
namespace {

// Of a piece that was cut out nothing is left; a few pixels at the border of another hole are noise.
db::Seen what_was_seen(double share_gone) {
  constexpr double kOut = 0.9, kNoise = 0.05;
  return share_gone >= kOut ? db::Seen::kCut : share_gone <= kNoise ? db::Seen::kStillThere : db::Seen::kUnclear;
}

// Was the wood as suspect as it is when its first picture was taken? A proposal may wait for days, while the piece is
// settled, cut again and suspect anew.
Result<bool> was_suspect(Repositories& r, const SuspectWood& wood, const std::vector<TakenTile>& tiles) {
  const auto steps = r.jobs.history({wood.piece});
  if (!steps) return steps.error();
  return std::ranges::all_of(
      tiles, [&](const TakenTile& tile) { return steps->empty() || steps->back().at <= tile.taken_at; });
}

}  // namespace

Result<SeenSuspects> see_suspects(Repositories& r, const SeenSheet& seen, const std::string& at) {
  SeenSuspects out;
  const auto& suspects = seen.suspects;
  const auto& gone = seen.read.suspects_gone;
  const bool unfit = std::ranges::any_of(seen.read.warnings, is_unfit_light);
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    const auto piece = r.jobs.find_piece({suspects[i].piece});
    if (!piece) return piece.error();
    // Somebody said it while the scan was being looked at.
    if (piece->state != db::PieceState::kSuspect || piece->allocation.value != suspects[i].allocation) continue;
    const auto as_now = was_suspect(r, suspects[i], seen.tiles);
    if (!as_now) return as_now.error();
    if (!*as_now) continue;
    db::Sighting sighting{what_was_seen(gone[i]), gone[i], 0, seen.tiles.empty() ? at : seen.tiles.back().taken_at};
    // In a light that was not learnt change is no sign; before a later map it may have been gone, and shows none since.
    if (unfit || (seen.later_map && sighting.seen == db::Seen::kStillThere)) sighting.seen = db::Seen::kUnclear;
    out.noted.emplace_back(db::AllocationId{suspects[i].allocation}, sighting);
    out.told.push_back({piece->job, piece->mark, sighting});
  }
  return out;
}

}  // namespace veneer::daemon
