#include "daemon/database_check.h"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.h"
#include "db/database.h"

namespace veneer::daemon {

using nlohmann::json;

DatabaseCheck::DatabaseCheck(boost::asio::io_context& reactor, std::filesystem::path file,
                             std::function<void()> on_change)
    : reactor_(reactor), file_(std::move(file)), on_change_(std::move(on_change)) {}

DatabaseCheck::~DatabaseCheck() { cancel(); }

void DatabaseCheck::cancel() {
  giving_up_.request_stop();
  if (checking_ != nullptr) checking_->cancel_check();
}

void DatabaseCheck::take(const Status& sound) {
  if (!sound && sound.error().code == ErrorCode::kCancelled) return;
  checked_at_ = utc_timestamp();
  // Nobody can tell a check that could not read the file from a file that cannot be read.
  state_ = sound ? State::kGood : State::kDamaged;
  sentence_ = sound ? "" : sound.error().message;
}

void DatabaseCheck::after_unclean_end(DatabaseThread& database, std::function<void(Done)> recover) {
  checking_ = &database;
  unrecovered_ = true;
  state_ = State::kChecking;
  sentence_ =
      "the database was not closed in order and is being checked: nothing begins before that is done, try again in a "
      "minute";
  const Done done = while_alive([this](const Status& sound) {
    if (sound) unrecovered_ = false;
    take(sound);
    on_change_();
  });
  database.check(while_alive([this, done, recover = std::move(recover)](const Status& sound) {
    checking_ = nullptr;
    sound ? recover(done) : done(sound);
  }));
}

DatabaseCheck::Done DatabaseCheck::while_alive(Done then) const {
  return [alive = std::weak_ptr<int>(alive_), then = std::move(then)](const Status& status) {
    if (!alive.expired()) then(status);
  };
}

Result<std::int64_t> DatabaseCheck::on_demand(TaskRegistry& tasks) {
  if (on_demand_ || state_ == State::kChecking)
    return Error{ErrorCode::kConflict, "the database is being checked already: wait until that is done"};
  on_demand_ = true;
  const TaskReporter task = tasks.start("integrity check", "reading the whole database");
  worker_.post([this, task, alive = std::weak_ptr<int>(alive_), giving_up = giving_up_.get_token()] {
    std::stop_source stop;
    const std::stop_callback by_task(task.stop_token(), [&stop] { stop.request_stop(); });
    const std::stop_callback by_end(giving_up, [&stop] { stop.request_stop(); });
    const auto begun = SteadyClock().now();
    const auto check = [&]() -> Status {
      auto database = db::Database::open_for_reading(file_);
      return database ? database->check_integrity(stop.get_token()) : Status(database.error());
    };
    const Status sound = caught(check);
    const double seconds = std::chrono::duration<double>(SteadyClock().now() - begun).count();
    boost::asio::post(reactor_, [this, alive, task, sound, seconds] {
      if (alive.expired()) return;
      on_demand_ = false;
      // That the file is sound does not bring the recovery that failed: the next start does.
      if (!sound || !unrecovered_) take(sound);
      if (sound)
        task.done({{"file", file_.string()}, {"seconds", seconds}, {"sound", true}});
      else
        task.fail(sound.error());
      on_change_();
    });
  });
  return task.id();
}

json DatabaseCheck::to_json() const {
  const char* word = state_ == State::kGood ? "good" : state_ == State::kChecking ? "checking" : "damaged";
  return {{"state", word},
          {"sentence", sentence_.empty() ? json() : json(sentence_)},
          {"checked", checked_at_.empty() ? json() : json(checked_at_)}};
}

Status DatabaseCheck::may_begin(std::string_view operation, const ApiRequest& request) const {
  if (state_ == State::kGood) return Ok();
  // Who comes in, what only ends something, and the check itself.
  constexpr std::array<std::string_view, 5> kAlways = {"openSession", "newConsoleLink", "cancelTask", "laserJogStop",
                                                       "checkIntegrity"};
  constexpr std::array<std::string_view, 4> kEnding = {"abort", "hold", "stop", "stop-after-piece"};
  if (std::ranges::count(kAlways, operation) > 0) return Ok();
  if (operation == "command" && std::ranges::count(kEnding, request.path_param("command")) > 0) return Ok();
  return Error{state_ == State::kChecking ? ErrorCode::kUnavailable : ErrorCode::kStorage, sentence_};
}

}  // namespace veneer::daemon
