// The end of a run that was broken off, from the abort until the disk has taken it. What was proven is booked all the
// same, and what the database does not take is kept for the next Clear: without its end no run could begin after this
// one until the daemon is restarted.
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <optional>

#include "base/log.h"
#include "daemon/unit/activity.h"
#include "daemon/unit/broken_run.h"

namespace veneer::daemon {

class OwedEnd {
 public:
  // Of write_down(): how many neighbours were hit.
  using Written = std::function<void(const Result<int>&)>;
  // What waits for a write is dropped with the host's activity; the end itself is not. `host` outlives this.
  OwedEnd(ActivityHost& host, Logger log) : host_(host), log_(std::move(log)) {}

  // Broken off in this turn of the reactor; the laser may have yet to tell how.
  void begin(BrokenRun run) { breaking_ = std::move(run); }
  // What the laser tells of it. False when none waits for that.
  bool take(const laser_event::Aborted& told);
  // Only after begin(): what was begun is written; `then` comes whether the database took it or not.
  void write(std::function<void(int neighbours)> then);

  // The database could not take one. It stays so until it is known to be written, for a STOP may come between (writing
  // it twice changes nothing).
  bool unwritten() const { return unwritten_.has_value(); }
  // Only while unwritten(): writes that one once more. Whether it is over, unwritten() tells: an error may be the
  // database's last word on it.
  void try_again(Written then) { write_end(*unwritten_, std::move(then)); }
  // Begun or unwritten.
  bool any() const { return breaking_.has_value() || unwritten(); }

 private:
  void write_end(BrokenRun run, Written then);

  ActivityHost& host_;
  Logger log_;
  std::optional<BrokenRun> breaking_, unwritten_;
};

}  // namespace veneer::daemon
