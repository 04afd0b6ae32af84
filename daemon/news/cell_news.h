// What the cell tells of itself without being asked: tasks as they change, alarms, notices to whoever is away. Alarms
// and tasks outlive the daemon: they are kept in two small files (kept_file.h).
//
// Bound to the reactor.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/tasks.h"
#include "daemon/config.h"
#include "daemon/news/alarm_book.h"
#include "daemon/news/cell_status.h"
#include "daemon/news/metrics.h"
#include "daemon/news/notifier.h"
#include "daemon/news/untold_failures.h"
#include "daemon/records/kept_file.h"
#include "daemon/store/audit_log.h"
#include "daemon/threads/worker.h"
#include "daemon/unit/unit_state.h"
#include "daemon/workers/work_runner.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class CellNews {
 public:
  // All of it outlives this.
  struct Parts {
    const Config& config;
    const UnitState& unit;
    const LaserDriver& laser;
    const CellStatus& status;
    EventHub& hub;
    TaskRegistry& tasks;
    AlarmBook& alarms;
    AuditLog& audit;
    WorkRunner& workers;  // which tell others
    Metrics& metrics;
    Worker& keeper;      // writes the files
    const Clock& clock;  // real time
  };
  // `on_alarms` comes when an alarm has begun, ended or was acknowledged; not when one only got less urgent.
  CellNews(const Parts& parts, std::function<void()> on_alarms, Logger log);

  // Alarms and tasks, as the daemon before this one left them. Before the reactor runs and any task begins.
  void go_on_from_before();
  // Gives up notices that are under way; nobody is told any more.
  void end() { notifier_.reset(); }

  // Of every change of a task.
  void changed(const TaskView& task);
  // `by` was answered with this task, which may be over by then.
  void began(std::int64_t task, const Caller& by);
  // Somebody was sent this task, as it stands.
  void told(const TaskView& task, const Caller& by);
  // How long whoever asked for a task may take to look what it was refused for, before that is an alarm.
  std::chrono::milliseconds time_to_look{10'000};
  void look_for_untold();
  // What is an alarm now, or none any more; what else somebody who is away has to know.
  void look();
  // To be told of every change of the unit's view: what somebody has to know of a state that may last for a moment.
  void unit_changed();

  // Somebody acknowledged some.
  void alarms_changed();
  // A notice that says that it is a try, to whoever is told of alarms: the task that sends it. REQUIRES: end() was not
  // called.
  Result<std::int64_t> try_notices();

 private:
  void look_for_alarms();
  void look_for_notices();
  void tell_of(const TaskView& task);
  void take_end(const TaskView& task);
  void note_failure(const TaskView& task);
  bool listens(const std::string& who) const { return p_.hub.is_followed_by(who); }
  void notify(const Notice& notice);
  void keep_alarms();
  void keep_task(const TaskView& changed);
  void keep_tasks();

  const Parts p_;
  std::function<void()> on_alarms_;
  Logger log_;
  UntoldFailures untold_;
  KeptFile kept_alarms_, kept_tasks_;
  std::int64_t last_kept_ = 0;               // the newest task that is
  std::optional<JobId> told_done_;           // the unit's job, once it was told that it is done
  CellState noticed_ = CellState::kStopped;  // the unit's state when it was looked whether somebody is to be told
  std::unique_ptr<Notifier> notifier_;
};

}  // namespace veneer::daemon
