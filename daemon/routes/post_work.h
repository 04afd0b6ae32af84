// Hands slow work to a worker whose queue is bounded: whoever asks is told when there is no room, and when the work
// ends with an exception. Bound to the reactor.
#pragma once

#include <functional>
#include <utility>

#include "daemon/api/router.h"
#include "daemon/api/tasks.h"
#include "daemon/workers/worker.h"

namespace veneer::daemon {

inline constexpr std::size_t kMostWaiting = 16;  // for each worker

inline Error no_room() {
  return {ErrorCode::kUnavailable, "too much work of this kind is waiting already: try again when some of it is done"};
}

// `work` reports to `task`, whatever becomes of it.
inline void post_task(Worker& worker, const TaskReporter& task, std::function<void()> work) {
  if (!worker.try_post(kMostWaiting, std::move(work), [task](const Error& error) { task.fail(error); }))
    task.fail(no_room());
}

}  // namespace veneer::daemon
