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

OwedProof::OwedProof(const UnitParts& parts, Logger log, std::function<void(JobId, const std::string&)> on_doubt)
    : parts_(parts), log_(std::move(log)), on_doubt_(std::move(on_doubt)) {}

void OwedProof::owe(db::UnprovenCuts cuts) {
  if (cuts.pieces.empty()) return;
  parts_.bed.hands_were_in();  // a picture from before the last of them was burnt proves nothing of them
  owed_.push_back(std::move(cuts));
  pause_ = left_ = 1;
}

void OwedProof::look() {
  if (owed_.empty() || looking_) return;
  looking_ = true;
  const bool was_open = lid_is_open(parts_.laser.status());
  parts_.bed.look([this, was_open, alive = std::weak_ptr<int>(alive_)](const Result<ProvenPose>& look) {
    if (alive.expired()) return;
    looking_ = false;
    // Through an open lid a panel that lies as it did is seen to; one that is not seen may be behind a hand.
    const bool may_miss_it = was_open || lid_is_open(parts_.laser.status());
    if (look.ok() || !may_miss_it) judge(look);
  });
}

void OwedProof::look_now_and_then() {
  if (owed_.empty() || --left_ > 0) return;
  left_ = pause_ = std::min(2 * pause_, kLongestPause);
  look();
}

void OwedProof::judge(const Result<ProvenPose>& look) {
  if (!tells_where(look)) return;
  for (auto& cuts : std::exchange(owed_, {})) judge(std::move(cuts), look);
}

void OwedProof::judge(db::UnprovenCuts cuts, const Result<ProvenPose>& look) {
  const ProvenPose pose{cuts.run.panel, true, cuts.run.bed_from_panel, cuts.run.pose_rms};  // cut back up, and no other
  const Status unmoved = require_unmoved(look, pose, kMovedSinceBegun, "since its first piece was begun");
  if (!unmoved) return doubt(std::move(cuts), unmoved.error().message);
  log_->info("panel {} lies as it did in run {}: what was cut last is proven", cuts.run.panel.value, cuts.run.id.value);
  parts_.database.async([run = cuts.run.id](Repositories& r) { return r.jobs.note_proof(run, utc_timestamp()); },
                        [log = log_](const Status& noted) {
                          if (!noted) log->warn("{}", noted.error().message);  // another look after the next start
                        });
}

void OwedProof::doubt(db::UnprovenCuts cuts, const std::string& why) {
  // What was seen is not asked of the camera again while the disk is full: the panel may be laid back meanwhile.
  parts_.database.owe([pieces = cuts.pieces](Repositories& r) { return r.jobs.make_suspect(pieces, utc_timestamp()); },
                      [this, alive = std::weak_ptr<int>(alive_), job = cuts.run.job, n = cuts.pieces.size(), why] {
                        if (alive.expired()) return;
                        on_doubt_(job, fmt::format("{}; {} cut before the end and not looked at since, perhaps into "
                                                   "the bare bed, and {} suspect",
                                                   why, n == 1 ? "one piece was" : fmt::format("{} pieces were", n),
                                                   n == 1 ? "is" : "are"));
                      });
}

}  // namespace veneer::daemon
