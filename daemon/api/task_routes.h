// GET /tasks, GET /tasks/{id}, DELETE /tasks/{id}.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "daemon/api/router.h"
#include "daemon/api/tasks.h"

namespace veneer::daemon {

// `tasks` outlives the router. `on_told` hears of each task that is sent to somebody who asked for it by its number.
// `strike` leaves out of a task's sentences what viewers are not told; empty: they are told all, its whole result too.
void bind_task_routes(Router& router, TaskRegistry& tasks,
                      const std::function<void(const TaskView&, const Caller&)>& on_told = {},
                      const std::function<void(nlohmann::json&)>& strike = {});

}  // namespace veneer::daemon
