#include "daemon/unit/owed_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/store/calibration.h"
#include "daemon/unit/preflight.h"

namespace veneer::daemon {
namespace {

constexpr int kLongestPause = 64;

std::string told(const db::UnprovenCuts& cuts, const std::string& why) {
  const std::size_t n = cuts.pieces.size();
  return fmt::format(
      "{}; {} cut before the end and not looked at since, perhaps into "
      "the bare bed, and {} suspect: say what became of {} with veneerctl "
      "job settle {}",
      why, n == 1 ? "one piece was" : fmt::format("{} pieces were", n), n == 1 ? "is" : "are", n == 1 ? "it" : "each",
      cuts.run.job.value);
}

}  // namespace

OwedProof::OwedProof(const UnitParts& parts, Logger log, std::function<void()> on_change,
                     std::function<void(JobId, const std::string&)> on_doubt)
    : parts_(parts), log_(std::move(log)), on_change_(std::move(on_change)), on_doubt_(std::move(on_doubt)) {}

void OwedProof::owe(db::UnprovenCuts cuts) {
  if (cuts.pieces.empty()) return;
  parts_.bed.hands_were_in();  // a picture from before the last of them was burnt proves nothing of them
  disturb();
  owed_.push_back(std::make_shared<Owed>(Owed{std::move(cuts)}));
  pause_ = left_ = 1;
  on_change_();
}

bool OwedProof::any() const {
  return std::ranges::any_of(owed_, [](const Cuts& owed) { return !owed->judged; });
}

void OwedProof::look() {
  if (!any() || looking_) return;
  looking_ = true;
  const bool hands_were_in = !check_lid(parts_.laser.status());
  look_for_cut(parts_.bed, [this, hands_were_in, before = disturbed_,
                            alive = std::weak_ptr<int>(alive_)](const Result<ProvenPose>& look) {
    if (alive.expired()) return;
    looking_ = false;
    if (disturbed_ != before) return void(left_ = 1);  // it is taken again once all is at rest
    // Through an open lid a panel that lies as it did is seen to; one that is not seen may be behind a hand.
    const LaserStatus laser = parts_.laser.status();
    const bool may_miss_it = hands_were_in || !check_lid(laser);
    if (look.ok() || (!may_miss_it && tells_where(look))) return judge(look);
    if (!any()) return;
    why_not_ = !may_miss_it || !tells_where(look) ? look.error().message
               : lid_is_open(laser)               ? "the lid is open, and it may be behind a hand"
                                                  : "the lid was open just now, and it may have been behind a hand";
    on_change_();
  });
}

void OwedProof::look_now_and_then() {
  if (!any() || --left_ > 0) return;
  left_ = pause_ = std::min(2 * pause_, kLongestPause);
  look();
}

void OwedProof::judge(const Result<ProvenPose>& look) {
  if (!tells_where(look)) return;
  for (const Cuts& owed : to_judge()) judge(owed, look);
}

void OwedProof::write_off(const std::string& who) {
  for (const Cuts& owed : to_judge()) doubt(owed, fmt::format("{} says that nobody can look any more", who));
}

std::vector<OwedProof::Cuts> OwedProof::to_judge() {
  why_not_.clear();
  std::vector<Cuts> out;
  for (const Cuts& owed : owed_)
    if (!std::exchange(owed->judged, true)) out.push_back(owed);
  return out;
}

std::optional<OwedLook> OwedProof::view() const {
  if (owed_.empty()) return std::nullopt;
  const db::UnprovenCuts& last = owed_.back()->cuts;
  const int n = static_cast<int>(last.pieces.size());
  const std::string pieces = n == 1 ? "a piece" : fmt::format("{} pieces", n);
  if (owed_.back()->judged)
    return OwedLook{last.run.job, last.run.panel, n,
                    fmt::format("what the camera saw of panel {} since {} of job {} {} cut from it is still to be "
                                "written: wait, or make room on the disk",
                                last.run.panel.value, pieces, last.run.job.value, n == 1 ? "was" : "were")};
  const std::string waits = fmt::format(
      "the camera has not seen panel {} since {} of job {} {} cut from it, so nobody knows whether "
      "it lay under the beam: leave it as it lies until the camera has looked, with the lid closed and the "
      "light on",
      last.run.panel.value, pieces, last.run.job.value, n == 1 ? "was" : "were");
  return OwedLook{last.run.job, last.run.panel, n,
                  why_not_.empty()
                      ? waits
                      : fmt::format("{} ({}); when it cannot look any more, veneerctl write-off-look makes "
                                    "them suspect",
                                    waits, why_not_)};
}

void OwedProof::judge(const Cuts& owed, const Result<ProvenPose>& look) {
  const db::RunRecord& run = owed->cuts.run;
  const ProvenPose pose{run.panel, true, run.bed_from_panel, run.pose_rms};  // cut back up, and no other
  const Status unmoved = require_unmoved(look, pose, kMovedSinceBegun, "since its first piece was begun");
  const auto verdict = std::make_shared<std::string>(unmoved ? "" : unmoved.error().message);
  const auto write = [run, pieces = owed->cuts.pieces, verdict](Repositories& r) -> Status {
    const auto changed = bed_frame_has_changed(r, run.id);
    if (!changed) return changed.error();
    if (*changed)
      *verdict = fmt::format(
          "the camera or the laser was calibrated anew since panel {} was cut, so nobody can tell "
          "whether it lies as it did",
          run.panel.value);
    return verdict->empty() ? r.jobs.note_proof(run.id, utc_timestamp()) : r.jobs.make_suspect(pieces, utc_timestamp());
  };
  settle(owed, write, verdict);
}

void OwedProof::doubt(const Cuts& owed, const std::string& why) {
  const auto write = [pieces = owed->cuts.pieces](Repositories& r) {
    return r.jobs.make_suspect(pieces, utc_timestamp());
  };
  settle(owed, write, std::make_shared<std::string>(why));
}

// What was seen is not asked of the camera again while the disk is full: the panel may be laid back meanwhile.
void OwedProof::settle(const Cuts& owed, std::function<Status(Repositories&)> write, const Verdict& verdict) {
  const auto written = [this, owed, verdict, alive = std::weak_ptr<int>(alive_)](const Status& done) {
    if (alive.expired()) return;
    std::erase(owed_, owed);
    if (!done)
      log_->warn("{}", done.error().message);  // somebody has said meanwhile what became of them
    else if (verdict->empty())
      log_->info("panel {} lies as it did in run {}: what was cut last is proven", owed->cuts.run.panel.value,
                 owed->cuts.run.id.value);
    on_change_();
    if (done && !verdict->empty()) on_doubt_(owed->cuts.run.job, told(owed->cuts, *verdict));
  };
  parts_.database.owe(
      std::move(write),
      [this, alive = std::weak_ptr<int>(alive_)] {
        if (!alive.expired()) on_change_();
      },
      written);
}

}  // namespace veneer::daemon
