#include "daemon/news/untold_failures.h"

#include <utility>

namespace veneer::daemon {

bool is_refusal(const TaskView& failed) {
  if (failed.state != TaskState::kFailed || !failed.error) return false;
  if (failed.kind == "backup" || failed.kind == "integrity check") return false;
  switch (failed.error->code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kNotFound:  // a name that nothing has; a file of the cell's that is gone is kStorage
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

bool UntoldFailures::began(std::int64_t task, bool is_over, const Caller& by, const Listens& listens) {
  if (is_over && !untold_.contains(task)) return false;
  asked_[task] = by;
  const auto untold = untold_.find(task);
  if (untold == untold_.end()) return false;
  if (untold->second.told.contains(by.who) || hears(task, listens)) untold_.erase(untold), asked_.erase(task);
  return true;
}

void UntoldFailures::ended(const TaskView& task, TimePoint now, const Listens& listens) {
  if (is_refusal(task) && !hears(task.id, listens))
    untold_[task.id] = {task, now, {}};
  else
    asked_.erase(task.id);
}

bool UntoldFailures::told(const TaskView& task, const std::string& who) {
  const auto untold = untold_.find(task.id);
  if (untold == untold_.end()) return false;
  const auto by = asked_.find(task.id);
  if (by == asked_.end()) {
    untold->second.told.insert(who);
    return false;
  }
  if (by->second.who != who) return false;
  untold_.erase(untold);
  asked_.erase(by);
  return true;
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

std::vector<UntoldFailures::Kept> UntoldFailures::kept() const {
  std::vector<Kept> out;
  for (const auto& [task, untold] : untold_) {
    const auto by = asked_.find(task);
    out.push_back(by == asked_.end() ? Kept{task, {}, {}} : Kept{task, by->second.who, by->second.transport});
  }
  return out;
}

void UntoldFailures::go_on(const TaskView& task, const Kept& kept, TimePoint now) {
  untold_[task.id] = {task, now, {}};
  if (kept.who.empty()) return;
  Caller by;
  by.who = kept.who, by.transport = kept.transport;
  asked_[task.id] = by;
}

}  // namespace veneer::daemon
