#include "daemon/api/task_routes.h"

#include "daemon/api/page.h"

namespace veneer::daemon {
namespace {

using Strike = std::function<void(nlohmann::json&)>;

bool is_told_less(const Caller& caller, const Strike& strike) { return strike && caller.role < Role::kOperator; }

// As this caller may read it.
TaskView shown_to(const Caller& caller, const TaskView& task, const Strike& strike) {
  return is_told_less(caller, strike) ? shown_to_viewers(task, strike) : task;
}

// What is done does not change any more: whoever has its result already is not sent it again, unless he may read more
// of it by now.
void answer_task(TaskRegistry& tasks, std::int64_t id, const ApiRequest& request, const Strike& strike,
                 const Reply& reply) {
  const TaskView* task = tasks.find(id);
  if (!task) {
    reply(ApiReply::error(
        Error{ErrorCode::kNotFound, "there is no task " + std::to_string(id) + ", or it is long over"}));
    return;
  }
  const std::string whose = is_told_less(request.caller, strike) ? "-viewer\"" : "\"";
  const std::string etag = task->result ? "\"" + std::to_string(id) + "-" + task->result->hash + whose : "";
  if (!etag.empty() && etag_matches(request.if_none_match, etag)) return reply(ApiReply::not_modified(etag));
  ApiReply told =
      ApiReply::bytes(to_text(shown_to(request.caller, *task, strike), {{"schema_version", 1}}), "application/json");
  told.etag = etag;
  reply(std::move(told));
}

}  // namespace

void bind_task_routes(Router& router, TaskRegistry& tasks,
                      const std::function<void(const TaskView&, const Caller&)>& on_told, const Strike& strike) {
  router.bind("listTasks", [&tasks, strike](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    auto shown = tasks.list();
    std::erase_if(shown, [&](const TaskView* task) { return task->id <= page.after; });
    const nlohmann::json next = cut_to_page(shown, page, [](const TaskView* task) { return task->id; });
    nlohmann::json list = nlohmann::json::array();
    for (const TaskView* task : shown) list.push_back(to_list_json(shown_to(request.caller, *task, strike)));
    reply(ApiReply::json({{"tasks", std::move(list)}, {"next", next}}));
  });
  router.bind("getTask", [&tasks, on_told, strike](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    if (const TaskView* task = tasks.find(*id); task && on_told) on_told(*task, request.caller);
    answer_task(tasks, *id, request, strike, reply);
  });
  router.bind("cancelTask", [&tasks, strike](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    if (const Status cancelled = tasks.cancel(*id); !cancelled) return reply(ApiReply::error(cancelled.error()));
    answer_task(tasks, *id, request, strike, reply);
  });
}

}  // namespace veneer::daemon
