// Hands slow work to a worker whose queue is bounded: whoever asks is told when there is no room, and when the work
// ends with an exception. Bound to the reactor.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <string>
#include <utility>

#include "daemon/api/route_table.h"
#include "daemon/api/router.h"
#include "daemon/api/tasks.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

// For each worker. Pictures of two plans may be as large as any.
inline constexpr WaitingRoom kWaitingRoom{16, 2 * kPictureBody};

inline Error no_room() {
  return {ErrorCode::kUnavailable, "too much work of this kind is waiting already: try again when some of it is done"};
}

// The end of a task that was begun elsewhere. `work` reports to `task`, whatever becomes of it, and holds `bytes` of
// what was sent until it begins.
inline void post_task(Worker& worker, const TaskReporter& task, std::function<void()> work, std::size_t bytes = 0) {
  if (!worker.try_post(
          kWaitingRoom, std::move(work), [task](const Error& error) { task.fail(error); }, bytes))
    task.fail(no_room());
}

// A task of the worker's alone: answered with 202, or with 503 at once when there is no room.
inline void start_task(TaskRegistry& tasks, Worker& worker, const std::string& kind, const std::string& text,
                       const Reply& reply, std::function<void(const TaskReporter&)> work, std::size_t bytes = 0) {
  if (!worker.has_room(kWaitingRoom)) return reply(ApiReply::busy("too much work of this kind is waiting already"));
  if (!worker.has_room(kWaitingRoom, bytes))
    return reply(ApiReply::busy(fmt::format("the pictures that wait already leave no room for one of {:.1f} MiB",
                                            static_cast<double>(bytes) / (1024 * 1024))));
  const TaskReporter task = tasks.start(kind, text);
  post_task(
      worker, task, [task, work = std::move(work)] { work(task); }, bytes);
  reply(ApiReply::task(task.id()));
}

}  // namespace veneer::daemon
