// Pieces of a run that was over before the camera could look once more: booked `cut`, on what the head did, and nobody
// knows whether the panel still lay under them. The next look that tells where the panel is proves them, or makes them
// suspect. A STOP owes this look as a kill does, and it waits for neither: it is taken beam off, where the head stands.
//
// A panel that has moved makes the pieces suspect, even if somebody may have moved it after the run. While the camera
// gives no picture it is asked again, less and less often; until one can be judged, or a person says that there will be
// none, the pieces are neither good nor lost. Once camera or axes are calibrated anew, positions are in another frame
// than the run's: no look can prove them any more, and they are suspect. What was found is in view() until that is
// written.
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
  // One that is still to be taken.
  bool any() const;
  // The head moves from here on, or hands may be at the bed for it: a look that is under way tells nothing.
  void disturb() { ++disturbed_; }
  // Beam off, and nothing moves.
  void look();
  // Comes regularly while look() might be called.
  void look_now_and_then();
  // By somebody's look at the bed since.
  void judge(const Result<ProvenPose>& look);
  // Nobody can look any more, says a person: all of them are suspect.
  void write_off(const std::string& who);
  // What is owed, or found and not written yet, and what to do about it; nothing when nothing is.
  std::optional<OwedLook> view() const;

 private:
  struct Owed {
    db::UnprovenCuts cuts;
    bool judged = false;  // a look or a person has told, and that is still to be written
  };
  using Cuts = std::shared_ptr<Owed>;
  std::vector<Cuts> to_judge();  // which are judged from here on
  void judge(const Cuts& owed, const Result<ProvenPose>& look);
  void doubt(const Cuts& owed, const std::string& why);
  // Why they are suspect; "" when they are proven. Of the thread that writes until it is written.
  using Verdict = std::shared_ptr<std::string>;
  // Writes it, whatever the disk says now; then it is told, and owed no more.
  void settle(const Cuts& owed, std::function<Status(Repositories&)> write, const Verdict& verdict);

  const UnitParts parts_;
  Logger log_;
  std::function<void()> on_change_;
  std::function<void(JobId, const std::string&)> on_doubt_;
  std::vector<Cuts> owed_;
  std::string why_not_;  // the last look told nothing; "" before it
  bool looking_ = false;
  int disturbed_ = 0;         // how often
  int pause_ = 1, left_ = 1;  // calls of look_now_and_then() between two looks, and until the next
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
