#include "daemon/news/kept_tasks.h"

#include <string>
#include <utility>

#include "daemon/workers/error_json.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr int kTasksFormat = 1;
constexpr const char* kUnfinished =
    "the cell's program ended while this was under way, and it did not come to its end: look whether it was done, and "
    "start it again if not";

json task_to_json(const TaskView& task) {
  json out = {{"id", task.id}, {"kind", task.kind}, {"state", to_string(task.state)}, {"text", task.text}};
  if (task.error) out["error"] = error_to_json(*task.error);
  if (!task.result) return out;
  const bool whole = task.result->json.size() <= kLongestKeptResult;
  out["shortened"] = task.shortened || !whole;
  out["result"] = json::parse(whole ? task.result->json : task.result->brief, nullptr, false);
  if (out["result"].is_discarded()) out["result"] = json::object();
  return out;
}

// Throws json::exception.
TaskView task_from_json(const json& one) {
  TaskView task;
  task.id = one.at("id");
  task.kind = one.at("kind");
  task.text = one.at("text");
  const std::string state = one.at("state");
  if (state == to_string(TaskState::kDone)) {
    task.state = TaskState::kDone;
    task.progress = 1;
    task.result = std::make_shared<const TaskResult>(one.at("result"), task.kind);
    task.shortened = one.at("shortened");
    return task;
  }
  task.state = state == to_string(TaskState::kCancelled) ? TaskState::kCancelled : TaskState::kFailed;
  task.error = state == to_string(TaskState::kRunning)
                   ? Error{ErrorCode::kUnavailable, kUnfinished}
                   : error_from_json(one.at("error")).value_or(Error{ErrorCode::kInternal, "nobody knows why"});
  return task;
}

}  // namespace

json tasks_to_json(std::int64_t last_id, const std::vector<TaskView>& tasks,
                   const std::vector<UntoldFailures::Kept>& untold) {
  json list = json::array(), nobody_told = json::array();
  for (const TaskView& task : tasks) list.push_back(task_to_json(task));
  for (const auto& one : untold)
    nobody_told.push_back({{"task", one.task}, {"who", one.who}, {"by_socket", one.transport == TransportKind::kUnix}});
  return {
      {"format", kTasksFormat}, {"last_id", last_id}, {"tasks", std::move(list)}, {"untold", std::move(nobody_told)}};
}

std::optional<KeptTasks> tasks_from_json(const json& kept) {
  try {
    if (kept.at("format") != kTasksFormat) return std::nullopt;
    KeptTasks out;
    out.last_id = kept.at("last_id");
    for (const json& one : kept.at("tasks")) {
      out.tasks.push_back(task_from_json(one));
      if (one.at("state") == to_string(TaskState::kRunning)) out.unfinished.push_back(out.tasks.back());
    }
    for (const json& one : kept.value("untold", json::array()))
      out.untold.push_back({one.at("task"), one.at("who"),
                            one.at("by_socket").get<bool>() ? TransportKind::kUnix : TransportKind::kTcp});
    return out;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace veneer::daemon
