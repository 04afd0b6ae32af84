#include "daemon/news/cell_news.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "daemon/news/cell_alarms.h"
#include "daemon/news/kept_alarms.h"
#include "daemon/news/kept_tasks.h"
#include "daemon/news/left_out_places.h"
#include "daemon/store/backup.h"

namespace veneer::daemon {

using nlohmann::json;

CellNews::CellNews(const Parts& parts, std::function<void()> on_alarms, Logger log)
    : p_(parts),
      on_alarms_(std::move(on_alarms)),
      log_(std::move(log)),
      kept_alarms_(p_.config.store.data_dir / kAlarmsName, log_),
      kept_tasks_(p_.config.store.data_dir / kTasksName, log_) {
  NotifierOptions notices;
  notices.to = p_.config.notify;
  notices.data_dir = p_.config.store.data_dir;
  notifier_ = std::make_unique<Notifier>(
      std::move(notices), p_.workers, log_,
      [&metrics = p_.metrics](const std::string& outcome) { metrics.notice_ended(outcome); });
}

void CellNews::changed(const TaskView& task) {
  tell_of(task);
  take_end(task);
  keep_task(task);
}

void CellNews::began(std::int64_t task, const Caller& by) {
  const TaskView* view = p_.tasks.find(task);
  const bool is_over = !view || view->state != TaskState::kRunning;
  if (untold_.began(task, is_over, by, [this](const std::string& who) { return listens(who); })) keep_tasks();
}

void CellNews::told(const TaskView& task, const Caller& by) {
  if (untold_.told(task, by.who)) keep_tasks();
}

void CellNews::look() {
  look_for_alarms();
  look_for_notices();
}

// Whoever waits for a job's end may begin the next one before anything is looked at.
void CellNews::unit_changed() {
  if (!p_.unit.view().job) told_done_.reset();
  if (p_.unit.view().state == CellState::kComplete) return look_for_notices();
  if (noticed_ == CellState::kComplete) noticed_ = CellState::kStopped;
}

void CellNews::notify(const Notice& notice) {
  if (notifier_) notifier_->tell(notice);
}

Result<std::int64_t> CellNews::try_notices() {
  if (!notifier_->names_somebody())
    return Error{ErrorCode::kConflict,
                 "nobody is to be told: name a webhook or a broker under [notify] of veneerd.toml"};
  TaskReporter reporter = p_.tasks.start("notify", "telling whoever is to be told");
  notifier_->try_all(reporter);
  return reporter.id();
}

// What was aborted or held is an alarm.
void CellNews::look_for_notices() {
  const CellView& view = p_.unit.view();
  if (std::exchange(noticed_, view.state) == view.state) return;
  const auto job = view.job ? std::optional(view.job->id.value) : std::nullopt;
  // It is Complete again after a recut, or where that was refused.
  if (view.state == CellState::kComplete && view.job && std::exchange(told_done_, view.job->id) != view.job->id)
    notify({Notice::What::kJobDone, false,
            fmt::format("job {} ({}) is done: {} of {} pieces are cut{}", view.job->id.value, view.job->name,
                        view.job->cut, view.job->pieces,
                        view.job->suspect > 0 ? fmt::format(", {} suspect", view.job->suspect) : ""),
            utc_timestamp(), job});
  if (view.state == CellState::kSuspended)
    notify({Notice::What::kOperatorNeeded, false, p_.status.next().sentence, utc_timestamp(), job});
}

void CellNews::go_on_from_before() {
  if (const json kept = kept_alarms_.read(); !kept.is_null())
    if (auto book = book_from_json(kept)) p_.alarms = std::move(*book);
  const json kept = kept_tasks_.read();
  auto before = kept.is_null() ? std::nullopt : tasks_from_json(kept);
  if (!before) return;
  p_.tasks.go_on(before->last_id, std::move(before->tasks));
  for (const auto& untold : before->untold)
    if (const TaskView* task = p_.tasks.find(untold.task)) untold_.go_on(*task, untold, p_.clock.now());
  for (const TaskView& task : before->unfinished) {
    log_->warn("task {} ({}): {}", task.id, task.kind, task.error->message);
    p_.audit.write({0, utc_timestamp(), "veneerd", "task.unfinished",
                    fmt::format("task {}, {}: {}", task.id, task.kind, task.error->message)});
    note_failure(task);
    keep_task(task);
  }
}

void CellNews::keep_alarms() {
  kept_alarms_.write(p_.keeper, [book = p_.alarms] { return book_to_json(book); });
}

// Its beginning and its end; how far it is may be lost.
void CellNews::keep_task(const TaskView& changed) {
  if (changed.state == TaskState::kRunning && changed.id <= last_kept_) return;
  last_kept_ = std::max(last_kept_, changed.id);
  keep_tasks();
}

void CellNews::keep_tasks() {
  std::vector<TaskView> views;
  for (const TaskView* task : p_.tasks.list()) views.push_back(*task);
  kept_tasks_.write(p_.keeper, [last = p_.tasks.last_id(), views = std::move(views), untold = untold_.kept()] {
    return tasks_to_json(last, views, untold);
  });
}

void CellNews::alarms_changed() {
  keep_alarms();
  p_.hub.broadcast({{"type", "alarms"}});
  on_alarms_();
}

void CellNews::look_for_alarms() {
  if (!p_.status.is_counted()) return;  // what is not known yet has not gone
  const auto changes =
      p_.alarms.take(cell_alarms(p_.unit.view(), p_.laser.status(), p_.status.needs()), utc_timestamp());
  for (const Alarm& alarm : changes.begun) {
    p_.audit.write({0, alarm.since, "veneerd", "alarm.new", alarm.what.sentence});
    notify({Notice::What::kAlarm, alarm.what.urgent, alarm.what.sentence, alarm.since});
  }
  for (const Alarm& alarm : changes.ended)
    p_.audit.write({0, alarm.until, "veneerd", "alarm.returned", alarm.what.sentence});
  if (changes.any()) return alarms_changed();
  if (changes.eased) keep_alarms();  // or what gets worse after a restart would be held against what it was
}

// Whoever asked for it may have gone.
void CellNews::note_failure(const TaskView& task) {
  const Alarm alarm = p_.alarms.happened(failure_of(task), utc_timestamp());
  p_.audit.write({0, alarm.since, "veneerd", "alarm.new", alarm.what.sentence});
  notify({Notice::What::kAlarm, false, alarm.what.sentence, alarm.since});
  alarms_changed();
}

void CellNews::take_end(const TaskView& task) {
  if (task.state == TaskState::kRunning) return;
  untold_.ended(task, p_.clock.now(), [this](const std::string& who) { return listens(who); });
  if (task.state != TaskState::kFailed) return;
  log_->warn("task {} ({}): {}", task.id, task.kind, task.error->message);
  if (!is_refusal(task)) note_failure(task);
}

void CellNews::look_for_untold() {
  const auto overdue = untold_.take_before(p_.clock.now() - time_to_look);
  for (const TaskView& task : overdue) note_failure(task);
  if (!overdue.empty()) keep_tasks();
}

void CellNews::tell_of(const TaskView& task) {
  const bool is_over = task.state != TaskState::kRunning;
  if (!is_over && p_.hub.clients() == 0) return;
  const std::string event = task_event(task);
  std::string to_viewers = task_event(shown_to_viewers(task, [this](json& told) {
    leave_out_places(told, p_.laser.status().why_not_connected, p_.alarms, p_.config.laser);
  }));
  is_over ? p_.hub.broadcast_text(event, std::move(to_viewers))
          : p_.hub.broadcast_passing_text(event, std::move(to_viewers));
}

}  // namespace veneer::daemon
