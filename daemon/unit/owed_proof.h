// Pieces of a run that was over before the camera could look once more: booked `cut`, on what the head did, and nobody
// knows whether the panel still lay under them. The next look that tells where the panel is proves them, or makes them
// suspect. A STOP owes this look as a kill does, and it waits for neither: it is taken beam off, where the head stands.
//
// What hands may have done since explains nothing. A camera that says nothing is asked again, less and less often: so
// long the pieces are neither good nor lost, until a look tells, or a person says that there will be none.
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/log.h"
#include "daemon/unit/activity.h"
#include "daemon/unit/cell_view.h"
#include "db/job_store.h"

namespace veneer::daemon {

class OwedProof {
 public:
  // `on_change` comes when view() has changed, and what a look told is written; `on_doubt` is told of pieces of a job
  // that are suspect now, in a sentence.
  OwedProof(const UnitParts& parts, Logger log, std::function<void()> on_change,
            std::function<void(JobId, const std::string&)> on_doubt);

  void owe(db::UnprovenCuts cuts);
  bool any() const { return !owed_.empty(); }
  // Beam off, and nothing moves.
  void look();
  // Comes regularly while look() might be called.
  void look_now_and_then();
  // By somebody's look at the bed since.
  void judge(const Result<ProvenPose>& look);
  // Nobody can look any more, says a person: all of them are suspect.
  void write_off(const std::string& who);
  // What is owed, and what to do about it; nothing when nothing is.
  std::optional<OwedLook> view() const;

 private:
  void judge(db::UnprovenCuts cuts, const Result<ProvenPose>& look);
  void doubt(db::UnprovenCuts cuts, const std::string& why);
  std::vector<db::UnprovenCuts> settled();  // none is owed any more; told of when that is written

  const UnitParts parts_;
  Logger log_;
  std::function<void()> on_change_;
  std::function<void(JobId, const std::string&)> on_doubt_;
  std::vector<db::UnprovenCuts> owed_;
  std::string why_not_;  // the last look told nothing; "" before it
  bool looking_ = false;
  int pause_ = 1, left_ = 1;  // calls of look_now_and_then() between two looks, and until the next
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
