// Failed tasks of which it is not known yet whether whoever asked for them was told. What somebody asked for and was
// refused needs nobody else; what nobody was told of needs somebody who may not be looking: it becomes an alarm. Pure.
//
// Whoever asked is told when he has the task's end: he asks for the task, or listens to the event stream when it ends.
// They outlive the daemon (kept_tasks.h), however it ended: whoever asked may look again once it is back.
//
// Over the Unix socket a stream tells nothing: callers there are known by their user alone, and another program of that
// user may listen. Over TCP and TLS it is an account that listens, not a program: what another program of the same
// account hears counts as told.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/clock.h"
#include "daemon/api/api_message.h"
#include "daemon/api/tasks.h"

namespace veneer::daemon {

// Can this failure be the answer to what was asked for? Devices, disks and processes that fail give none, nor does what
// is lost; and what goes on unattended (backups, the check of the database) is asked for by a timer, not by a person.
bool is_refusal(const TaskView& failed);

class UntoldFailures {
 public:
  using Listens = std::function<bool(const std::string& who)>;  // to the event stream, at this moment

  // `by` was answered with this task, which may have ended before. true: kept() is another one.
  bool began(std::int64_t task, bool is_over, const Caller& by, const Listens& listens);
  // To be told of every task that ends, after the event stream. A refusal is kept until it is told; anything else is
  // forgotten.
  void ended(const TaskView& task, TimePoint now, const Listens& listens);
  // `who` was sent this task as it stands; perhaps before it was known who had asked for it. true: kept() is another
  // one.
  bool told(const TaskView& task, const std::string& who);
  // Those that nobody was told of although they ended before `then`; they are kept no longer.
  std::vector<TaskView> take_before(TimePoint then);
  struct Kept {
    std::int64_t task = 0;
    std::string who;  // "": not known
    TransportKind transport = TransportKind::kUnix;
  };
  std::vector<Kept> kept() const;  // by number
  // One that the daemon before this one left; it ended at `now`, as far as looking is concerned.
  void go_on(const TaskView& task, const Kept& kept, TimePoint now);

 private:
  struct Untold {
    TaskView task;
    TimePoint since;
    std::set<std::string> told;  // while it is not known who asked
  };
  bool hears(std::int64_t task, const Listens& listens) const;

  std::map<std::int64_t, Caller> asked_;  // of tasks that run, or are untold
  std::map<std::int64_t, Untold> untold_;
};

}  // namespace veneer::daemon
