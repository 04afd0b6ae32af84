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
  const auto untold = untold_.find(task);
  if (untold == untold_.end() || (!untold->second.told.contains(by.who) && !hears(task, listens))) return;
  untold_.erase(untold), asked_.erase(task);
}

void UntoldFailures::ended(const TaskView& task, TimePoint now, const Listens& listens) {
  if (is_refusal(task) && !hears(task.id, listens))
    untold_[task.id] = {task, now, {}};
  else
    asked_.erase(task.id);
}

void UntoldFailures::told(const TaskView& task, const std::string& who) {
  const auto untold = untold_.find(task.id);
  if (untold == untold_.end()) return;
  const auto by = asked_.find(task.id);
  if (by == asked_.end()) {
    untold->second.told.insert(who);
  } else if (by->second.who == who) {
    untold_.erase(untold);
    asked_.erase(by);
  }
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
