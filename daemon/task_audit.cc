#include "daemon/task_audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr std::size_t kMostOfAList = 20;

bool is_short(const json& value) {
  if (value.is_array())
    return value.size() <= kMostOfAList &&
           std::ranges::all_of(value, [](const json& one) { return one.is_primitive(); });
  return value.is_primitive();
}

// Numbers and names, as JSON; not the shapes and lists that a client may have asked for.
std::string short_form(const json& result) {
  if (!result.is_object()) return "";
  json out = json::object();
  for (const auto& [key, value] : result.items())
    if (is_short(value)) out[key] = value;
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

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
              task.error ? task.error->message : short_form(task.result)});
}

}  // namespace veneer::daemon
