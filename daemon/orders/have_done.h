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

}  // namespace veneer::daemon
