// Long work that somebody waits for: its state, its progress, its end. Workers report from any thread; what the API
// and its clients see changes on the reactor only.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "daemon/threads/reactor_timer.h"

namespace veneer::daemon {

struct TaskGate;

enum class TaskState { kRunning, kDone, kFailed, kCancelled };
const char* to_string(TaskState state);

// What a task of this kind was done for. It may be megabytes: serialised once, by the worker that reports it, and
// shared.
struct TaskResult {
  explicit TaskResult(const nlohmann::json& result, std::string_view kind = {});
  const std::string json;
  const std::string brief;  // its numbers, names and short lists alone, as JSON (at most 4 kB); "" when it is no object
  const std::string hash;
  // The same without ports and paths; null where it has none. Only the fields that hold them are struck: what people
  // typed is told to all.
  const std::shared_ptr<const TaskResult> to_viewers;
};

struct TaskView {
  std::int64_t id = 0;
  std::string kind;  // "scan", "plan", "calibrate camera", ...
  TaskState state = TaskState::kRunning;
  double progress = 0;                       // 0..1, never falls
  std::string text;                          // what is going on, for a person
  std::shared_ptr<const TaskResult> result;  // of a done task
  std::optional<Error> error;                // of a failed or cancelled one
  bool shortened = false;                    // of `result` only what is short outlived the daemon that made it
};

// As whoever only looks on is told of it: `strike` leaves out of sentences what he is not told.
TaskView shown_to_viewers(const TaskView& task, const std::function<void(nlohmann::json&)>& strike);

// {"id", "kind", "state", "progress", "text", "error": error_json(), "shortened": true}: without the result, as it
// stands in a list.
nlohmann::json to_list_json(const TaskView& task);
// An event of the stream, as text: {"type": "task", "task": ...} as in a list; a done one has "summary" besides,
// TaskResult::brief. Each listener gets it, so it stays small; whoever wants the result asks for the task.
std::string task_event(const TaskView& task);
// As in a list, as text, with "result": what is known of it already is only copied. `more` is added to the object.
std::string to_text(const TaskView& task, const nlohmann::json& more = nlohmann::json::object());

// The worker's end of a task. Copies speak of the same task. Thread-safe; does nothing once the registry is gone.
// The last copy dropped before the end was reported fails the task.
class TaskReporter {
 public:
  std::int64_t id() const;
  std::stop_token stop_token() const;
  // Cheap: what the reactor has not seen yet is overwritten, so call it as often as you like.
  void progress(double fraction, std::string text) const;
  void done(const nlohmann::json& result) const;
  void fail(Error error) const;  // kCancelled ends it as cancelled
  // done or fail, whichever the result says.
  void finish(const Result<nlohmann::json>& result) const;

  struct Shared;  // what worker and registry both hold; opaque

 private:
  friend class TaskRegistry;
  explicit TaskReporter(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<Shared> shared_;
};

// Bound to the reactor.
class TaskRegistry {
 public:
  static constexpr std::size_t kKept = 100;                        // the oldest finished ones go first
  static constexpr std::chrono::milliseconds kEventInterval{100};  // between two events of one running task

  // `clock` is real time, and `timer` runs by it. `on_change` runs on the reactor with every change worth an event:
  // start and end at once, text and progress at most every kEventInterval; the last of them is always told.
  TaskRegistry(boost::asio::io_context& reactor, const Clock& clock, std::unique_ptr<OneShotTimer> timer,
               std::function<void(const TaskView&)> on_change);
  ~TaskRegistry();  // asks every running task to stop; does not wait
  TaskRegistry(const TaskRegistry&) = delete;
  TaskRegistry& operator=(const TaskRegistry&) = delete;

  // What a registry before this one left, none of it running. Numbers go on kSkipped after its last: whoever waits for
  // a task that was begun too late to be left here must not be told of another one. Before anything is started.
  void go_on(std::int64_t last_id, std::vector<TaskView> before);
  static constexpr std::int64_t kSkipped = 10;
  std::int64_t last_id() const { return last_id_; }

  TaskReporter start(std::string kind, std::string text);
  const TaskView* find(std::int64_t id) const;
  // Oldest first; to be used before anything else of the registry is.
  std::vector<const TaskView*> list() const;
  std::vector<const TaskView*> running() const;
  // Asks it to stop; it ends when its worker says so. kNotFound, or kConflict when it is over.
  Status cancel(std::int64_t id);

 private:
  friend struct TaskReporter::Shared;
  struct Entry;
  void take(const std::shared_ptr<TaskReporter::Shared>& shared);
  void tell(Entry& entry);
  void tell_due();  // those whose interval is over; comes back for the others
  void prune();

  const Clock& clock_;
  std::unique_ptr<OneShotTimer> timer_;
  bool timed_ = false;
  std::function<void(const TaskView&)> on_change_;
  std::int64_t last_id_ = 0;
  std::deque<std::unique_ptr<Entry>> entries_;
  std::shared_ptr<TaskGate> gate_;  // what reporters post through; shut by the destructor
};

}  // namespace veneer::daemon
