// Hands slow work to a worker whose queue is bounded: whoever asks is told when there is no room, and when the work
// ends with an exception. Bound to the reactor.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "daemon/api/router.h"
#include "daemon/api/tasks.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

inline constexpr std::size_t kMostWaiting = 16;  // for each worker

inline Error no_room() {
  return {ErrorCode::kUnavailable, "too much work of this kind is waiting already: try again when some of it is done"};
}

// The end of a task that was begun elsewhere. `work` reports to `task`, whatever becomes of it.
inline void post_task(Worker& worker, const TaskReporter& task, std::function<void()> work) {
  if (!worker.try_post(kMostWaiting, std::move(work), [task](const Error& error) { task.fail(error); }))
    task.fail(no_room());
}

// A task of the worker's alone: answered with 202, or with 503 at once when there is no room.
inline void start_task(TaskRegistry& tasks, Worker& worker, const std::string& kind, const std::string& text,
                       const Reply& reply, std::function<void(const TaskReporter&)> work) {
  if (worker.waiting() >= kMostWaiting) return reply(ApiReply::busy("too much work of this kind is waiting already"));
  const TaskReporter task = tasks.start(kind, text);
  post_task(worker, task, [task, work = std::move(work)] { work(task); });
  reply(ApiReply::task(task.id()));
}

}  // namespace veneer::daemon
