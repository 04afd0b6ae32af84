#include "daemon/records/database_check.h"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.h"
#include "db/database.h"
#include "db/plans.h"

namespace veneer::daemon {

using nlohmann::json;

DatabaseCheck::DatabaseCheck(boost::asio::io_context& reactor, DatabaseThread& database, std::filesystem::path file,
                             std::function<void()> on_change)
    : reactor_(reactor), database_(database), file_(std::move(file)), on_change_(std::move(on_change)) {}

DatabaseCheck::~DatabaseCheck() { cancel(); }

namespace {

// A file that could not be read this time, or not to its end, may be sound.
bool proves_damage(const Error& error) {
  return error.code != ErrorCode::kCancelled && error.code != ErrorCode::kUnavailable;
}

}  // namespace

void DatabaseCheck::cancel() {
  giving_up_.request_stop();
  database_.cancel_check();
}

void DatabaseCheck::take(const Status& sound) {
  if (!sound && sound.error().code == ErrorCode::kCancelled) return;
  checked_at_ = utc_timestamp();
  if (state_ == State::kDamaged) return;
  // Nobody can tell a check that could not read the file from a file that cannot be read.
  state_ = sound ? State::kGood : State::kDamaged;
  sentence_ = sound ? "" : sound.error().message;
}

void DatabaseCheck::after_unclean_end(std::function<void(Done)> recover) {
  unrecovered_ = at_start_ = true;
  state_ = State::kChecking;
  sentence_ =
      "the database was not closed in order and is being checked: nothing begins before that is done, try again in a "
      "minute";
  const Done done = while_alive([this](const Status& sound) {
    if (sound) unrecovered_ = false;
    at_start_ = false;
    take(sound);
    on_change_();
    if (TaskRegistry* tasks = std::exchange(due_, nullptr)) is_due(*tasks);
  });
  database_.check(
      while_alive([done, recover = std::move(recover)](const Status& sound) { sound ? recover(done) : done(sound); }));
}

DatabaseCheck::Done DatabaseCheck::while_alive(Done then) const {
  return [alive = std::weak_ptr<int>(alive_), then = std::move(then)](const Status& status) {
    if (!alive.expired()) then(status);
  };
}

Result<std::int64_t> DatabaseCheck::on_demand(TaskRegistry& tasks) {
  if (on_demand_ || at_start_)
    return Error{ErrorCode::kConflict, "the database is being checked already: wait until that is done"};
  on_demand_ = true;
  const TaskReporter task = tasks.start("integrity check", "reading the whole database");
  worker_.post([this, task, alive = std::weak_ptr<int>(alive_), giving_up = giving_up_.get_token()] {
    std::stop_source stop;
    const std::stop_callback by_task(task.stop_token(), [&stop] { stop.request_stop(); });
    const std::stop_callback by_end(giving_up, [&stop] { stop.request_stop(); });
    const auto begun = SteadyClock().now();
    const int doubts = database_.call([](Repositories& r) { return r.connection.doubts(); });
    const Status sound = caught([&] { return check_rows(stop.get_token()); });
    // A plan that is lost is no reason to write nothing any more: the wood is known without it.
    const Status plans = sound ? caught([&] { return check_plans(stop.get_token()); }) : Ok();
    const double seconds = std::chrono::duration<double>(SteadyClock().now() - begun).count();
    // At once, so that it holds although the daemon ends before its reactor hears of it.
    if (!sound && proves_damage(sound.error())) database_.distrust(sound.error());
    if (sound) database_.dispel(doubts);
    // Whoever writes may have another file open than the one that was read.
    database_.ask_may_write([this, alive, task, sound, plans, seconds](const Status& may_write) {
      if (alive.expired()) return;
      const bool replaced = sound && !may_write && proves_damage(may_write.error());
      end_on_demand(task, replaced ? may_write : sound, plans, seconds);
    });
  });
  return task.id();
}

Status DatabaseCheck::check_rows(const std::stop_token& stop) const {
  auto database = db::Database::open_for_reading(file_);
  return database ? database->check_integrity(stop) : Status(database.error());
}

Status DatabaseCheck::check_plans(const std::stop_token& stop) const {
  auto database = db::Database::open_for_reading(file_);
  return database ? db::Plans(*database).check_files(stop) : Status(database.error());
}

void DatabaseCheck::end_on_demand(const TaskReporter& task, const Status& sound, const Status& plans, double seconds) {
  on_demand_ = false;
  // That the file is sound does not bring the recovery that failed: the next start does.
  if (sound ? !unrecovered_ : proves_damage(sound.error()))
    take(sound);
  else if (!sound && state_ == State::kChecking)
    sentence_ =
        "the database was not checked to its end, although another program wrote to it or a row of it is damaged, and "
        "nothing begins before that: check it with `veneerctl db check`";
  if (sound && !plans)
    task.fail(plans.error());
  else if (sound)
    task.done({{"file", file_.string()}, {"seconds", seconds}, {"sound", true}});
  else
    task.fail(sound.error());
  on_change_();
  if (TaskRegistry* tasks = std::exchange(due_, nullptr)) is_due(*tasks);
}

void DatabaseCheck::is_due(TaskRegistry& tasks) {
  if (state_ == State::kDamaged) return;
  if (!at_start_) {
    state_ = State::kChecking;
    sentence_ =
        "the database is being checked, because another program wrote to it or a row of it is damaged: nothing begins "
        "before that is done, try again in a minute";
    on_change_();
  }
  if (on_demand_ || at_start_)
    due_ = &tasks;
  else
    static_cast<void>(on_demand(tasks));
}

json DatabaseCheck::to_json() const {
  const char* word = state_ == State::kGood ? "good" : state_ == State::kChecking ? "checking" : "damaged";
  return {{"state", word},
          {"sentence", sentence_.empty() ? json() : json(sentence_)},
          {"checked", checked_at_.empty() ? json() : json(checked_at_)}};
}

bool DatabaseCheck::is_always_taken(std::string_view operation, const ApiRequest& request) {
  constexpr std::array<std::string_view, 9> kAlways = {"openSession",     "closeSession", "newConsoleLink",
                                                       "endConsoleLinks", "revokeToken",  "removeUser",
                                                       "cancelTask",      "laserJogStop", "checkIntegrity"};
  constexpr std::array<std::string_view, 4> kEnding = {"abort", "hold", "stop", "stop-after-piece"};
  return std::ranges::count(kAlways, operation) > 0 ||
         (operation == "command" && std::ranges::count(kEnding, request.path_param("command")) > 0);
}

namespace {

// What a job that runs needs to go on: its wood is its own.
bool goes_on(std::string_view operation, const ApiRequest& request) {
  if (operation == "laserOverrides") return true;
  if (operation != "command") return false;
  const std::string& word = request.path_param("command");
  return word == "unhold" || word == "unsuspend";
}

}  // namespace

Status DatabaseCheck::may_begin(std::string_view operation, const ApiRequest& request) const {
  if (state_ == State::kGood || is_always_taken(operation, request)) return Ok();
  if (state_ == State::kChecking && !at_start_ && goes_on(operation, request)) return Ok();
  return Error{state_ == State::kChecking ? ErrorCode::kUnavailable : ErrorCode::kStorage, sentence_};
}

}  // namespace veneer::daemon
