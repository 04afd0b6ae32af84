#include "daemon/unit/broken_run.h"

#include <algorithm>

#include "daemon/unit/burnt_wood.h"

namespace veneer::daemon {
namespace {

Result<std::vector<PieceId>> neighbours_of(Repositories& r, const BrokenRun& run, const std::string& at) {
  std::vector<PieceId> out;
  if (run.stray_path.empty()) return out;
  auto live = r.ledger.live_allocations(run.pose.panel);
  if (!live) return live.error();
  const auto hit = wood_under(r, run.pose, run.stray_path, run.stray_reach, at);
  for (const auto& allocation : *live) {
    const bool may_suffer =
        allocation.state == db::AllocationState::kReserved || allocation.state == db::AllocationState::kCut;
    if (allocation.piece == PieceId{} || !may_suffer) continue;
    // Without certificates nobody knows where on the panel the beam was.
    if (!hit || overlaps(*hit, allocation.area)) out.push_back(allocation.piece);
  }
  return out;
}

}  // namespace

void BrokenRun::take(const laser_event::Aborted& told) {
  suspects = told.suspect;
  stray_path = told.stray_path;
  stray_reach = told.stray_reach;
}

Result<int> write_down(Repositories& r, const BrokenRun& run, const std::string& at) {
  if (run.verified)
    if (const Status booked = r.jobs.book_piece(*run.verified, at); !booked && !has_settled(booked.error().code))
      return booked.error();
  auto neighbours = neighbours_of(r, run, at);
  if (!neighbours) return neighbours.error();
  if (!run.id) {
    if (const Status doubted = r.jobs.make_suspect(*neighbours, at); !doubted) return doubted.error();
    const Status aborted = run.waiting_job ? r.jobs.abort_job(*run.waiting_job, at) : Ok();
    if (!aborted && !has_settled(aborted.error().code)) return aborted.error();  // a planned job stays planned
    return static_cast<int>(neighbours->size());
  }
  std::erase_if(*neighbours, [&](PieceId piece) {
    return std::find(run.suspects.begin(), run.suspects.end(), piece) != run.suspects.end();
  });
  const int beside = static_cast<int>(neighbours->size());
  neighbours->insert(neighbours->end(), run.unproven.begin(), run.unproven.end());
  if (const Status ended = r.jobs.abort_run(*run.id, run.suspects, run.reason, at, *neighbours); !ended)
    return ended.error();
  return beside;
}

bool is_written(const Result<int>& written) { return written.ok() || has_settled(written.error().code); }

}  // namespace veneer::daemon
