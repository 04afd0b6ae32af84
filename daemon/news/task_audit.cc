#include "daemon/news/task_audit.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {

void TaskAudit::began(std::int64_t task, std::string who, std::string operation) {
  under_way_[task] = {std::move(who), std::move(operation)};
  if (const TaskView* now = tasks_.find(task)) changed(*now);
}

void TaskAudit::changed(const TaskView& task) {
  if (task.state == TaskState::kRunning) return;
  const auto asked = under_way_.extract(task.id);
  if (asked.empty()) return;
  log_.write({0, utc_timestamp(), asked.mapped().who,
              fmt::format("api.{}.{}", asked.mapped().operation, to_string(task.state)),
              task.error    ? task.error->message
              : task.result ? task.result->brief
                            : ""});
}

}  // namespace veneer::daemon
