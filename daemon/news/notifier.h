// Tells people who are not at the cell: by a webhook, by MQTT. Each place has a line of its own: a thread that has it
// done by worker processes (daemon/orders/notify_order.h), one notice after the other, so that a host that hangs costs
// a few of its own notices and nothing else: so many wait, what finds no room is dropped and counted, and what could
// not be delivered is tried twice again.
//
// Bound to the reactor.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/api/tasks.h"
#include "daemon/config.h"
#include "daemon/threads/worker.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct Notice {
  enum class What { kJobDone, kAlarm, kOperatorNeeded };
  What what = What::kAlarm;
  bool urgent = false;
  std::string sentence;  // for a person
  std::string at;        // UTC
  std::optional<std::int64_t> job = {};
};

struct NotifierOptions {
  NotifyConfig to;
  std::filesystem::path data_dir;              // for the workers' folders
  std::size_t most_waiting = 32;               // notices, in each line
  std::size_t more_for_urgent = 8;             // of them, and of those that need an operator
  std::chrono::milliseconds deadline{10'000};  // of one try
  std::vector<std::chrono::milliseconds> pauses = {std::chrono::seconds(5),
                                                   std::chrono::seconds(30)};  // before it is tried again
};

class Notifier {
 public:
  // `on_outcome` gets "delivered", "failed" or "dropped" for each notice and each place, from any thread.
  Notifier(NotifierOptions options, WorkRunner& workers, Logger log,
           std::function<void(const std::string& outcome)> on_outcome);
  ~Notifier();  // gives up what is under way
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void tell(const Notice& notice);
  bool names_somebody() const { return !lines_.empty(); }
  // Sends one that says that it is a try, to all of them, once; the task is done when all have it, and else names
  // one that has not. Only when names_somebody().
  void try_all(const TaskReporter& reporter);

 private:
  struct Shared;
  struct Line;
  struct OpenLine {
    std::shared_ptr<Line> line;
    std::unique_ptr<Worker> worker;
  };
  std::shared_ptr<Shared> shared_;
  std::vector<OpenLine> lines_;
};

}  // namespace veneer::daemon
