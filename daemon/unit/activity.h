// One thing the unit does with the laser, from the operator's word to its end: a panel's run, a recut, a pattern, a
// frame. An activity knows what it burns next and what its end means; whether it may go on (the operator's word, Hold,
// the lid, the proof of the pose) is decided in one place, by its host, the JobRunner.
//
//   look() -> prepare() -> go_on() -> burnt() -> go_on() -> burnt() -> ... -> ActivityHost::ended()
//
// Threading: bound to the reactor. What an activity waits for comes back through the host's while_current(): when the
// activity is broken off meanwhile, it never comes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/geometry.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/bed_view.h"
#include "daemon/unit/broken_run.h"
#include "daemon/unit/piece_burn.h"
#include "daemon/unit/run_planner.h"
#include "daemon/unit/runner_options.h"
#include "daemon/unit/work_record.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// What the unit works with. All of it outlives the unit.
struct UnitParts {
  LaserDriver& laser;
  DatabaseThread& database;
  BedView& bed;
  RunPlanner& planner;
  // Whether what is cut could be booked, as far as is known (disk_room.h); none: nobody is asked.
  std::function<Status()> may_book = {};
};

// Counts what is over, so that replies meant for it find out. Copies of a Moment outlive the Epoch.
class Epoch {
 public:
  class Moment {
   public:
    bool is_current() const { return *count_ == at_; }

   private:
    friend class Epoch;
    explicit Moment(std::shared_ptr<const std::int64_t> count) : count_(std::move(count)), at_(*count_) {}
    std::shared_ptr<const std::int64_t> count_;
    std::int64_t at_;
  };
  Epoch() : count_(std::make_shared<std::int64_t>(0)) {}
  ~Epoch() { ++*count_; }
  Epoch(const Epoch&) = delete;
  Epoch& operator=(const Epoch&) = delete;
  void end() { ++*count_; }
  Moment moment() const { return Moment(count_); }

 private:
  std::shared_ptr<std::int64_t> count_;
};

// Where the unit goes when an activity has ended in good order.
enum class Afterwards { kBack, kComplete, kStopped, kNextPanel };

class ActivityHost {
 public:
  virtual ~ActivityHost() = default;
  const UnitParts& parts() const { return parts_; }
  virtual const LaserLimits& limits() const = 0;
  // kRefused unless the machine can burn these as it stands (preflight.h).
  virtual Status check(std::span<const PieceBurn> burns) const = 0;

  // Asks for go_on(), which comes at once or when nothing stands against it any more.
  virtual void next() = 0;
  // The strokes go to the laser. Only from within go_on(), which has nothing to do after it.
  virtual void burn(const LaserJob& strokes) = 0;
  // Beam off, all over.
  virtual void abort(const std::string& reason) noexcept = 0;
  // The acting state before the last write, then the end. Nothing of the activity may run after ended().
  virtual void ending(Afterwards afterwards) = 0;
  // That the job is no longer under way is written with that last write, in its transaction: a kill finds both or
  // neither.
  virtual WorkRecord::End work_ends() = 0;
  virtual void ended(Afterwards afterwards, const std::string& reason) = 0;
  // It could not be done after all, and nothing of it was burnt: the unit goes back to where it was.
  virtual void refused(const Error& error) = 0;

  // For people: what is being burnt ("" = nothing), and that a piece is booked.
  virtual void show_piece(JobId job, const std::string& mark, double eta_seconds) = 0;
  virtual void piece_booked(const PieceBurn& burn) = 0;
  // The states of the job's pieces changed otherwise: `then` comes when the view shows them, and not at all when the
  // activity was broken off meanwhile.
  virtual void recount(std::function<void()> then) = 0;
  // What the look at the bed that is being answered tells a person, though the activity goes on; "" = nothing any more.
  virtual void bed_remark(const std::string& text) = 0;

  // Will the camera look again at what a run has cut?
  virtual bool looks_again() const = 0;
  // The run's panel was seen where it has to lie: what the run has booked so far was cut where it lay.
  virtual void proven(db::RunId run) = 0;
  // The run is over, and no look has proven these, which it booked or which are proven to be burnt.
  virtual void ends_unproven(db::UnprovenCuts cuts) = 0;

  // Wraps a continuation so that it is dropped when the activity is over meanwhile.
  template <class F>
  auto while_current(F then) {
    return [moment = epoch_.moment(), then = std::move(then)](auto&& result) mutable {
      if (moment.is_current()) then(std::forward<decltype(result)>(result));
    };
  }
  // A write the next step waits for: no go_on() before `then`.
  template <class Work, class Then>
  void commit(Work work, Then then) {
    ++commits_;
    parts_.database.async(std::move(work), while_current([this, then = std::move(then)](auto&& result) mutable {
                            --commits_;
                            then(std::forward<decltype(result)>(result));
                          }));
  }
  Epoch::Moment moment() const { return epoch_.moment(); }

 protected:
  explicit ActivityHost(const UnitParts& parts) : parts_(parts) {}
  const Epoch& epoch() const { return epoch_; }
  bool committing() const { return commits_ > 0; }
  void end_epoch() { epoch_.end(), commits_ = 0; }

 private:
  const UnitParts parts_;
  Epoch epoch_;
  int commits_ = 0;
};

class Activity {
 public:
  using Reply = std::function<void(Status)>;
  virtual ~Activity() = default;

  // Is it done while the unit stays in the state it was asked in (a frame, Suspended), instead of in Execute? Nothing
  // that could go on is Held then: what makes another activity rest gives this one up.
  virtual bool is_aside() const { return false; }
  // What goes on, for sentences: "tracing the frame". Of those that are aside.
  virtual std::string doing() const { return {}; }

  // What is written down before anything moves for it (work_record.h), as in "while a pattern was burnt". "": it is a
  // part of the job that is under way. Each says it: what moves without a record is no abort after a kill.
  virtual std::string recorded() const = 0;

  // Does the bed have to be looked at before the first stroke, and whenever hands may have been in?
  virtual bool needs_look() const = 0;
  // Looks with the beam off; a refusal says what is wrong with what lies there.
  virtual void look(Reply reply) = 0;
  // Does look() prove where a panel lies? Then it is repeated now and then, with the head out of the picture. Each says
  // it: wood of the stock that nobody looks at again is cut wherever it has been pushed.
  virtual bool proves_pose() const = 0;
  // Is something burnt since the last look that has to be proven by another one before the end?
  virtual bool ends_unproven() const = 0;
  // All that has to be ready before the first stroke; the bed is as it must be.
  virtual void prepare(const Reply& ready) { ready(Ok()); }

  // Where the next burn begins; nothing when there is none. The host lets nothing stand between an answer and go_on().
  virtual std::optional<Point<MachineFrame>> next_start() const = 0;
  // The laser rests and nothing stands against it: burn the next, or end.
  virtual void go_on() = 0;
  // The laser has burnt and verified what it was given last. `remark` is what a person should look at, mostly "".
  virtual void burnt(const std::string& remark) = 0;
  // The laser did not begin what it was given last. True: it stays the next.
  virtual bool not_begun() { return false; }

  // `who`, an operator, wants it to end in good order. False when it cannot: then it is broken off. `at_rest`: and
  // nothing more may be burnt before.
  virtual bool end_early(bool at_rest, const std::string& who) {
    static_cast<void>(at_rest), static_cast<void>(who);
    return false;
  }
  // It is over before its end, beam off; `who` broke it off, "": nobody did. Gives what is to be written down; nothing
  // where no wood of the stock can have been touched. `remark` gets what a person must know of it.
  virtual std::optional<BrokenRun> broken_off(const std::string& who, std::string& remark) = 0;
  // The end of all of it, for whoever waits for that. Said once.
  virtual void over(const Status& status) { static_cast<void>(status); }
  // kCancelled, with a sentence, when nobody wants the rest of it any more. The host asks after each proof, with a look
  // or without, and before anything else at Unhold: nothing of it begins then, and while it is Held only Stop ends it.
  virtual Status still_wanted() const { return Ok(); }
};

}  // namespace veneer::daemon
