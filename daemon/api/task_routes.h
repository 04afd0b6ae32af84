// GET /tasks, GET /tasks/{id}, DELETE /tasks/{id}.
#pragma once

#include "daemon/api/router.h"
#include "daemon/api/tasks.h"

namespace veneer::daemon {

// `tasks` outlives the router.
void bind_task_routes(Router& router, TaskRegistry& tasks);

}  // namespace veneer::daemon
