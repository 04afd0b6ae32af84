#include "daemon/unit/broken_run.h"

#include <algorithm>

#include "daemon/unit/burnt_wood.h"

namespace veneer::daemon {
namespace {

struct Struck {
  std::vector<PieceId> pieces;             // reserved or cut, and perhaps hit
  std::optional<Region<PanelFrame>> wood;  // all that may be hit; nothing where nobody knows, or where there is none
};

Result<Struck> struck_by(Repositories& r, const BrokenRun& run, const std::string& at) {
  Struck out;
  if (run.stray_path.empty()) return out;
  auto live = r.ledger.live_allocations(run.pose.panel);
  if (!live) return live.error();
  auto hit = wood_under(r, run.pose, run.stray_path, run.stray_reach, at);
  if (hit)
    out.wood = *std::move(hit);
  else if (hit.error().code == ErrorCode::kStorage)
    return hit.error();  // of the moment: it is asked again
  for (const auto& allocation : *live) {
    const bool may_suffer =
        allocation.state == db::AllocationState::kReserved || allocation.state == db::AllocationState::kCut;
    if (allocation.piece == PieceId{} || !may_suffer) continue;
    // Without certificates nobody knows where on the panel the beam was.
    if (!out.wood || overlaps(*out.wood, allocation.area)) out.pieces.push_back(allocation.piece);
  }
  return out;
}

// What belongs to nobody, or is only leased, would be taken for whole by the next plan: leases on it end.
Status write_off_struck(Repositories& r, const BrokenRun& run, const Struck& struck, const std::string& at) {
  if (!struck.wood) return Ok();
  const auto panel = r.panels.find(run.pose.panel);
  if (!panel) return panel.error();
  const Millimetres zero;
  const Region<PanelFrame> sheet(
      Ring<PanelFrame>{{zero, zero}, {panel->width, zero}, {panel->width, panel->height}, {zero, panel->height}});
  const auto wood = intersect(*struck.wood, sheet);
  if (wood.empty()) return Ok();
  const auto spoilt = r.ledger.write_off_free(run.pose.panel, wood, "a beam may have strayed here", at);
  return spoilt ? Ok() : Status(spoilt.error());
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
  auto struck = struck_by(r, run, at);
  if (!struck) return struck.error();
  // What can never be written off keeps no run open.
  if (const Status spoilt = write_off_struck(r, run, *struck, at); !spoilt && !has_settled(spoilt.error().code))
    return spoilt.error();
  std::vector<PieceId>* const neighbours = &struck->pieces;
  if (!run.id) {
    if (const Status doubted = r.jobs.make_suspect(*neighbours, at); !doubted) return doubted.error();
    const Status aborted = run.waiting_job ? r.jobs.abort_job(*run.waiting_job, at, run.who) : Ok();
    if (!aborted && !has_settled(aborted.error().code)) return aborted.error();  // a planned job stays planned
    return static_cast<int>(neighbours->size());
  }
  std::erase_if(*neighbours, [&](PieceId piece) {
    return std::find(run.suspects.begin(), run.suspects.end(), piece) != run.suspects.end();
  });
  const int beside = static_cast<int>(neighbours->size());
  neighbours->insert(neighbours->end(), run.unproven.begin(), run.unproven.end());
  if (const Status ended = r.jobs.abort_run(*run.id, run.suspects, run.reason, at, *neighbours, run.who); !ended)
    return ended.error();
  return beside;
}

bool is_written(const Result<int>& written) { return written.ok() || has_settled(written.error().code); }

}  // namespace veneer::daemon
