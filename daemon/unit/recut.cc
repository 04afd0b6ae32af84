#include "daemon/unit/recut.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/store/calibration.h"

namespace veneer::daemon {
namespace {

// A second cut must meet the first one's kerf.
constexpr Millimetres kMovedSinceCut{0.15};

// The camera tells places as it did, the machine goes to them as it did, and the pieces are still the ones that were
// cut there: since then one may have been given up, and its wood kept for another.
Status still_stands(Repositories& r, const KeptCuts::Basis& basis, const ProvenPose& pose,
                    const std::vector<PieceId>& pieces) {
  const std::string now = utc_timestamp();
  const auto calibration = load_calibration(r, now);
  if (!calibration) return calibration.error();
  for (const auto kind : {db::CertificateKind::kCamera, db::CertificateKind::kAxes}) {
    const auto standing = calibration->standing.find(kind);
    const bool in_force =
        standing != calibration->standing.end() && standing->second.at(now) == CertificateState::kValid;
    const auto& known = basis.certificates;
    if (!in_force || std::find(known.begin(), known.end(), standing->second.certificate) == known.end())
      return Error{
          ErrorCode::kRefused,
          fmt::format("the {} certificate is another than when panel {} was cut, so the laser can no longer "
                      "follow the same cuts exactly: make what is lost again with veneerctl job redo {} PIECE --lost",
                      db::to_string(kind), pose.panel.value, basis.job.value)};
  }
  for (const PieceId id : pieces) {
    const auto piece = r.jobs.find_piece(id);
    if (!piece) return piece.error();
    if (piece->state != db::PieceState::kCut || piece->panel != pose.panel)
      return Error{ErrorCode::kConflict,
                   fmt::format("piece {} is {} and no longer booked as cut from panel {}, so it is not cut again",
                               piece->mark, db::to_string(piece->state), pose.panel.value)};
  }
  return Ok();
}

}  // namespace

Recut::Recut(ActivityHost& host, const ProvenPose& pose, KeptCuts::Basis basis, std::vector<PieceBurn> burns)
    : host_(host), pose_(pose), basis_(std::move(basis)), burns_(std::move(burns)) {}

std::string Recut::recorded() const { return fmt::format("while pieces of job {} were cut again", basis_.job.value); }

void Recut::look(Reply reply) {
  std::vector<PieceId> pieces;
  for (const PieceBurn& burn : burns_) pieces.push_back(burn.piece);
  host_.parts().database.async(
      [basis = basis_, pose = pose_, pieces](Repositories& r) { return still_stands(r, basis, pose, pieces); },
      host_.while_current(
          [this, reply = std::move(reply)](const Status& stands) { stands ? look_at_bed(reply) : reply(stands); }));
}

void Recut::look_at_bed(const Reply& reply) {
  host_.parts().bed.look(host_.while_current([this, reply](const Result<ProvenPose>& look) {
    const Status unmoved = require_unmoved(look, pose_, kMovedSinceCut, "since it was cut");
    if (unmoved) return reply(Ok());
    reply(
        Error{unmoved.error().code,
              fmt::format(
                  "{}, so the same cuts are not burnt again: make what is lost again with veneerctl job redo {} PIECE "
                  "--lost",
                  unmoved.error().message, basis_.job.value)});
  }));
}

std::optional<Point<MachineFrame>> Recut::next_start() const {
  if (next_ == burns_.size()) return std::nullopt;
  return burns_[next_].strokes.strokes.front().path.front();
}

void Recut::go_on() {
  if (next_ == burns_.size()) {
    host_.show_piece(basis_.job, {}, 0);
    return host_.ended(Afterwards::kBack, {});
  }
  const PieceBurn& burn = burns_[next_++];
  host_.show_piece(basis_.job, burn.mark, 0);
  host_.burn(burn.strokes);
}

bool Recut::not_begun() {
  --next_;
  return true;
}

std::optional<BrokenRun> Recut::broken_off(const std::string&, std::string& remark) {
  if (next_ > 0) remark = fmt::format("; piece {} was being cut again: look at it", burns_[next_ - 1].mark);
  return BrokenRun{{}, {}, pose_, {}, {}, {}, {}, Millimetres(0), {}};
}

}  // namespace veneer::daemon
