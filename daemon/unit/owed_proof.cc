#include "daemon/unit/owed_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/unit/preflight.h"

namespace veneer::daemon {
namespace {

constexpr int kLongestPause = 64;

}  // namespace

OwedProof::OwedProof(const UnitParts& parts, Logger log, std::function<void()> on_change,
                     std::function<void(JobId, const std::string&)> on_doubt)
    : parts_(parts), log_(std::move(log)), on_change_(std::move(on_change)), on_doubt_(std::move(on_doubt)) {}

void OwedProof::owe(db::UnprovenCuts cuts) {
  if (cuts.pieces.empty()) return;
  parts_.bed.hands_were_in();  // a picture from before the last of them was burnt proves nothing of them
  owed_.push_back(std::move(cuts));
  pause_ = left_ = 1;
  on_change_();
}

void OwedProof::look() {
  if (owed_.empty() || looking_) return;
  looking_ = true;
  const bool was_open = lid_is_open(parts_.laser.status());
  look_for_cut(parts_.bed, [this, was_open, alive = std::weak_ptr<int>(alive_)](const Result<ProvenPose>& look) {
    if (alive.expired()) return;
    looking_ = false;
    // Through an open lid a panel that lies as it did is seen to; one that is not seen may be behind a hand.
    const bool may_miss_it = was_open || lid_is_open(parts_.laser.status());
    if (look.ok() || (!may_miss_it && tells_where(look))) return judge(look);
    if (owed_.empty()) return;
    why_not_ = may_miss_it && tells_where(look) ? "the lid is open, and it may be behind a hand" : look.error().message;
    on_change_();
  });
}

void OwedProof::look_now_and_then() {
  if (owed_.empty() || --left_ > 0) return;
  left_ = pause_ = std::min(2 * pause_, kLongestPause);
  look();
}

void OwedProof::judge(const Result<ProvenPose>& look) {
  if (!tells_where(look)) return;
  for (auto& cuts : settled()) judge(std::move(cuts), look);
}

void OwedProof::write_off(const std::string& who) {
  for (auto& cuts : settled()) doubt(std::move(cuts), fmt::format("{} says that nobody can look any more", who));
}

std::vector<db::UnprovenCuts> OwedProof::settled() {
  why_not_.clear();
  return std::exchange(owed_, {});
}

std::optional<OwedLook> OwedProof::view() const {
  if (owed_.empty()) return std::nullopt;
  const db::UnprovenCuts& last = owed_.back();
  const int n = static_cast<int>(last.pieces.size());
  const std::string waits = fmt::format(
      "the camera has not seen panel {} since {} of job {} {} cut from it, so nobody knows whether "
      "it lay under the beam: leave it as it lies until the camera has looked, with the lid closed and the "
      "light on",
      last.run.panel.value, n == 1 ? "a piece" : fmt::format("{} pieces", n), last.run.job.value,
      n == 1 ? "was" : "were");
  return OwedLook{last.run.job, last.run.panel, n,
                  why_not_.empty()
                      ? waits
                      : fmt::format("{} ({}); when it cannot look any more, veneerctl write-off-look makes "
                                    "them suspect",
                                    waits, why_not_)};
}

void OwedProof::judge(db::UnprovenCuts cuts, const Result<ProvenPose>& look) {
  const ProvenPose pose{cuts.run.panel, true, cuts.run.bed_from_panel, cuts.run.pose_rms};  // cut back up, and no other
  const Status unmoved = require_unmoved(look, pose, kMovedSinceBegun, "since its first piece was begun");
  if (!unmoved) return doubt(std::move(cuts), unmoved.error().message);
  log_->info("panel {} lies as it did in run {}: what was cut last is proven", cuts.run.panel.value, cuts.run.id.value);
  parts_.database.async([run = cuts.run.id](Repositories& r) { return r.jobs.note_proof(run, utc_timestamp()); },
                        [this, alive = std::weak_ptr<int>(alive_), log = log_](const Status& noted) {
                          if (!noted) log->warn("{}", noted.error().message);  // another look after the next start
                          if (!alive.expired()) on_change_();
                        });
}

void OwedProof::doubt(db::UnprovenCuts cuts, const std::string& why) {
  // What was seen is not asked of the camera again while the disk is full: the panel may be laid back meanwhile.
  parts_.database.owe([pieces = cuts.pieces](Repositories& r) { return r.jobs.make_suspect(pieces, utc_timestamp()); },
                      [this, alive = std::weak_ptr<int>(alive_), job = cuts.run.job, n = cuts.pieces.size(), why] {
                        if (alive.expired()) return;
                        on_change_();
                        on_doubt_(job, fmt::format("{}; {} cut before the end and not looked at since, perhaps into "
                                                   "the bare bed, and {} suspect: say what became of {} with veneerctl "
                                                   "job settle {}",
                                                   why, n == 1 ? "one piece was" : fmt::format("{} pieces were", n),
                                                   n == 1 ? "is" : "are", n == 1 ? "it" : "each", job.value));
                      });
}

}  // namespace veneer::daemon
