// A typed order and its typed answer, through a WorkRunner. Both types have a JSON form (shapes_json.h).
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stop_token>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// As WorkRunner::run() says; kInternal when the answer is not what was asked for.
template <class Answer, class Request>
Result<Answer> have_done(WorkRunner& runner, WorkOrder order, const Request& request, const TaskProgress& progress,
                         const std::stop_token& stop) {
  order.request = request;
  auto done = runner.run(order, progress, stop);
  if (!done) return done.error();
  try {
    return done->template get<Answer>();
  } catch (const nlohmann::json::exception&) {
    return Error{ErrorCode::kInternal,
                 fmt::format("{} was broken off, because its process answered nonsense: try again, and report it when "
                             "it comes back",
                             order.what)};
  }
}

// The same, and asked once more when it could not be done: kInternal and kUnavailable, as when the process was killed
// or crashed, or the device was away for a moment. For what a run needs, which should not wait for people on that
// account.
template <class Answer, class Request>
Result<Answer> have_done_despite_a_death(WorkRunner& runner, const WorkOrder& order, const Request& request,
                                         const TaskProgress& progress, const std::stop_token& stop) {
  Result<Answer> done = have_done<Answer>(runner, order, request, progress, stop);
  const bool lost =
      !done && (done.error().code == ErrorCode::kUnavailable || done.error().code == ErrorCode::kInternal);
  return lost ? have_done<Answer>(runner, order, request, progress, stop) : done;
}

}  // namespace veneer::daemon
