// What the cell tells of itself: alarms, notices to whoever is away, tasks; and what of that outlives the daemon.
#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/cell.h"
#include "daemon/news/cell_alarms.h"
#include "daemon/news/kept_alarms.h"
#include "daemon/news/kept_tasks.h"

namespace veneer::daemon {

using nlohmann::json;

void Cell::notify(const Notice& notice) {
  if (notifier_) notifier_->tell(notice);
}

Result<std::int64_t> Cell::try_notices() {
  if (!notifier_->names_somebody())
    return Error{ErrorCode::kConflict,
                 "nobody is to be told: name a webhook or a broker under [notify] of veneerd.toml"};
  TaskReporter reporter = tasks.start("notify", "telling whoever is to be told");
  notifier_->try_all(reporter);
  return reporter.id();
}

// What was aborted or held is an alarm.
void Cell::look_for_notices() {
  const CellView& view = runner->view();
  if (std::exchange(noticed_, view.state) == view.state) return;
  const auto job = view.job ? std::optional(view.job->id.value) : std::nullopt;
  if (view.state == CellState::kComplete && view.job)
    notify({Notice::What::kJobDone, false,
            fmt::format("job {} ({}) is done: {} of {} pieces are cut{}", view.job->id.value, view.job->name,
                        view.job->cut, view.job->pieces,
                        view.job->suspect > 0 ? fmt::format(", {} suspect", view.job->suspect) : ""),
            utc_timestamp(), job});
  if (view.state == CellState::kSuspended)
    notify({Notice::What::kOperatorNeeded, false, next().sentence, utc_timestamp(), job});
}

void Cell::go_on_from_before() {
  if (const json kept = kept_alarms_.read(); !kept.is_null())
    if (auto book = book_from_json(kept)) alarms = std::move(*book);
  const json kept = kept_tasks_.read();
  auto before = kept.is_null() ? std::nullopt : tasks_from_json(kept);
  if (!before) return;
  tasks.go_on(before->last_id, std::move(before->tasks));
  for (const auto& untold : before->untold)
    if (const TaskView* task = tasks.find(untold.task)) untold_.go_on(*task, untold, SteadyClock().now());
  for (const TaskView& task : before->unfinished) {
    log->warn("task {} ({}): {}", task.id, task.kind, task.error->message);
    audit_log_->write({0, utc_timestamp(), "veneerd", "task.unfinished",
                       fmt::format("task {}, {}: {}", task.id, task.kind, task.error->message)});
    note_failure(task);
    keep_task(task);
  }
}

void Cell::keep_alarms() {
  kept_alarms_.write(*keeper_, [book = alarms] { return book_to_json(book); });
}

// Its beginning and its end; how far it is may be lost.
void Cell::keep_task(const TaskView& changed) {
  if (!keeper_ || (changed.state == TaskState::kRunning && changed.id <= last_kept_)) return;
  last_kept_ = std::max(last_kept_, changed.id);
  keep_tasks();
}

void Cell::keep_tasks() {
  std::vector<TaskView> views;
  for (const TaskView* task : tasks.list()) views.push_back(*task);
  kept_tasks_.write(*keeper_, [last = tasks.last_id(), views = std::move(views), untold = untold_.kept()] {
    return tasks_to_json(last, views, untold);
  });
}

void Cell::alarms_changed() {
  keep_alarms();
  hub.broadcast({{"type", "alarms"}});
  broadcast_status();
}

void Cell::look_for_alarms() {
  if (!counted_) return;  // what is not known yet has not gone
  const auto changes = alarms.take(cell_alarms(runner->view(), devices.laser->status(), needs()), utc_timestamp());
  for (const Alarm& alarm : changes.begun) {
    audit_log_->write({0, alarm.since, "veneerd", "alarm.new", alarm.what.sentence});
    notify({Notice::What::kAlarm, alarm.what.urgent, alarm.what.sentence, alarm.since});
  }
  for (const Alarm& alarm : changes.ended)
    audit_log_->write({0, alarm.until, "veneerd", "alarm.returned", alarm.what.sentence});
  if (changes.any()) return alarms_changed();
  if (changes.eased) keep_alarms();  // or what gets worse after a restart would be held against what it was
}

nlohmann::json Cell::interlocks_json(const LaserStatus& laser, bool tell_why) const {
  InterlockFacts facts;
  if (guarded) facts.guardian = guarded();
  facts.camera = noted_camera_->last();
  facts.scanner = noted_scanner_->last();
  facts.picture_fresh = bed_pictures->last_fresh();
  facts.stock_refusal = runner->options().stock_refusal;
  facts.free_bytes = room_.free_bytes();
  facts.backups = backup_disk->seen();
  facts.backups_silent = backup_disk->silence();
  facts.finds_home = runner->limits().finds_home;
  facts.now = std::chrono::system_clock::now();
  facts.tell_why = tell_why;
  CellNeeds needed = needs();
  if (!counted_) needed.certificates.clear();  // nobody has read them yet
  return to_json(veneer::daemon::interlocks(runner->view(), laser, needed, facts));
}

// One look at a time: a disk that hangs is not asked again and again. The keeper waits for the data's disk anyway.
void Cell::look_at_store() {
  store_looked_at_ = std::chrono::steady_clock::now();
  backup_disk->look();
  if (std::exchange(looks_at_store_, true)) return;
  keeper_->post([this, alive = std::weak_ptr(alive_), data = config.store.data_dir] {
    std::error_code failed;
    const auto room = std::filesystem::space(data, failed);
    const auto free = failed ? std::nullopt : std::optional(room.available);
    boost::asio::post(reactor, [this, alive, free] {
      if (alive.expired()) return;
      looks_at_store_ = false;
      room_.told(free);
    });
  });
}

// Whoever asked for it may have gone.
void Cell::note_failure(const TaskView& task) {
  const Alarm alarm = alarms.happened(failure_of(task), utc_timestamp());
  notify({Notice::What::kAlarm, false, alarm.what.sentence, alarm.since});
  alarms_changed();
}

void Cell::take_end(const TaskView& task) {
  if (task.state == TaskState::kRunning) return;
  untold_.ended(task, SteadyClock().now(), [this](const std::string& who) { return listens(who); });
  if (task.state != TaskState::kFailed) return;
  log->warn("task {} ({}): {}", task.id, task.kind, task.error->message);
  if (!is_refusal(task)) note_failure(task);
}

void Cell::note_untold(TimePoint before) {
  const auto overdue = untold_.take_before(before);
  for (const TaskView& task : overdue) note_failure(task);
  if (!overdue.empty()) keep_tasks();
}

void Cell::tell_of(const TaskView& task) {
  if (task.state != TaskState::kRunning) return hub.broadcast_text(task_event(task));
  if (hub.clients() > 0) hub.broadcast_passing_text(task_event(task));
}

}  // namespace veneer::daemon
