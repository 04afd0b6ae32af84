#include "daemon/services/untold_failures.h"

#include <utility>

namespace veneer::daemon {

bool is_refusal(const TaskView& failed) {
  if (failed.state != TaskState::kFailed || !failed.error) return false;
  if (failed.kind == "backup" || failed.kind == "integrity check") return false;
  switch (failed.error->code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kConflict:
    case ErrorCode::kRefused:
      return true;
    default:
      return false;
  }
}

bool UntoldFailures::hears(std::int64_t task, const Listens& listens) const {
  const auto by = asked_.find(task);
  return by != asked_.end() && by->second.transport != TransportKind::kUnix && listens(by->second.who);
}

void UntoldFailures::began(std::int64_t task, bool is_over, const Caller& by, const Listens& listens) {
  if (is_over && !untold_.contains(task)) return;
  asked_[task] = by;
  if (untold_.contains(task) && hears(task, listens)) untold_.erase(task), asked_.erase(task);
}

void UntoldFailures::ended(const TaskView& task, TimePoint now, const Listens& listens) {
  if (is_refusal(task) && !hears(task.id, listens))
    untold_[task.id] = {task, now};
  else
    asked_.erase(task.id);
}

void UntoldFailures::told(const TaskView& task, const std::string& who) {
  if (!untold_.contains(task.id)) return;
  const auto by = asked_.find(task.id);
  if (by == asked_.end() || by->second.who != who) return;
  untold_.erase(task.id);
  asked_.erase(by);
}

std::vector<TaskView> UntoldFailures::take_before(TimePoint then) {
  std::vector<TaskView> out;
  for (auto one = untold_.begin(); one != untold_.end();) {
    if (one->second.since >= then) {
      ++one;
      continue;
    }
    asked_.erase(one->first);
    out.push_back(std::move(one->second.task));
    one = untold_.erase(one);
  }
  return out;
}

}  // namespace veneer::daemon
