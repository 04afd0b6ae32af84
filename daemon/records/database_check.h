// Whether the database is as it was written. It is checked whole after an unclean end, before anything is written to
// it, and whenever somebody asks, while the cell works. Reading the whole file takes seconds of a large one, so neither
// happens on the reactor: until a check after an unclean end has passed, or one that is due because another program
// wrote, and after any that found damage, nothing is begun that the database must keep. STOP, Hold, Stop and whatever
// only looks are never refused, and what another program did holds up no job that runs. Damage is for good in
// this life of the daemon, which has the damaged file open whatever is put in its place; nothing is written to it.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "daemon/api/api_message.h"
#include "daemon/api/tasks.h"
#include "daemon/store/database_thread.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

class DatabaseCheck {
 public:
  enum class State { kGood, kChecking, kDamaged };

  // `on_change` is called after every change of the state. `database` outlives this.
  DatabaseCheck(boost::asio::io_context& reactor, DatabaseThread& database, std::filesystem::path file,
                std::function<void()> on_change);
  ~DatabaseCheck();  // a check under way is given up
  DatabaseCheck(const DatabaseCheck&) = delete;
  DatabaseCheck& operator=(const DatabaseCheck&) = delete;

  // After an unclean end: on the database's own thread, so that whatever is asked of it meanwhile waits. When the
  // database is sound, `recover` sees to what the end left behind, and says how that went; only then things may begin.
  using Done = std::function<void(const Status&)>;
  void after_unclean_end(std::function<void(Done)> recover);
  // A task, on a connection and a thread of its own. kConflict while a check is under way.
  Result<std::int64_t> on_demand(TaskRegistry& tasks);
  // The same now, or once the check that is under way is done: something was seen that makes it necessary, and until
  // it has passed nothing begins.
  void is_due(TaskRegistry& tasks);
  void cancel();

  State state() const { return state_; }
  // Why nothing may begin; "" when it may.
  const std::string& sentence() const { return sentence_; }
  // {"state": "good|checking|damaged", "sentence", "checked": when a check passed or failed last in this life, or null}
  nlohmann::json to_json() const;
  // Who comes in, what only ends something, and the check itself: that is never put off.
  static bool is_always_taken(std::string_view operation, const ApiRequest& request);
  // Whether this operation of the API may go on: kUnavailable while the check is under way, kStorage after damage.
  Status may_begin(std::string_view operation, const ApiRequest& request) const;

 private:
  void take(const Status& sound);
  Status check_rows(const std::stop_token& stop) const;
  Status check_plans(const std::stop_token& stop) const;
  void end_on_demand(const TaskReporter& task, const Status& sound, const Status& plans, double seconds);
  Done while_alive(Done then) const;

  boost::asio::io_context& reactor_;
  DatabaseThread& database_;
  const std::filesystem::path file_;
  std::function<void()> on_change_;
  State state_ = State::kGood;
  std::string sentence_, checked_at_;
  bool unrecovered_ = false;     // what an unclean end left behind was not seen to
  bool at_start_ = false;        // the check after an unclean end is under way
  bool on_demand_ = false;       // another one is
  TaskRegistry* due_ = nullptr;  // one is due after that
  std::stop_source giving_up_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);  // what comes back to the reactor holds it weakly
  Worker worker_{"integrity", 10};
};

}  // namespace veneer::daemon
