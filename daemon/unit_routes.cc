#include <fmt/format.h>

#include "daemon/cell_routes.h"

namespace veneer::daemon {
namespace {

ApiReply taken(const Cell& cell) {
  return ApiReply::json({{"state", to_string(cell.runner->view().state)}, {"reason", cell.runner->view().reason}});
}

JobRunner::Reply reply_with_state(Cell& cell, Reply reply) {
  return [&cell, reply = std::move(reply)](const Status& done) {
    reply(done ? taken(cell) : ApiReply::error(done.error()));
  };
}

void run_command(Cell& cell, const ApiRequest& request, const Reply& reply) {
  const std::string& word = request.path_param("command");
  if (word == "stop-after-piece")
    return cell.runner->stop_after_piece(request.caller.who, reply_with_state(cell, reply));
  const auto command = command_from_string(word);
  if (!command || *command == CellCommand::kStart || *command == CellCommand::kSuspend ||
      *command == CellCommand::kComplete)
    return reply(ApiReply::error(
        {ErrorCode::kNotFound, fmt::format("there is no command {}: use hold, unhold, unsuspend, stop, abort, clear, "
                                           "reset or stop-after-piece",
                                           word)}));
  cell.runner->command(*command, request.caller.who, reply_with_state(cell, reply));
}

}  // namespace

ApiReply stop_at_once(Cell& cell, const Caller& caller) {
  cell.runner->command(CellCommand::kAbort, caller.who, [](const Status&) {});
  return taken(cell);
}

void bind_unit_routes(Router& router, Cell& cell) {
  router.bind("getStatus", [&cell](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(cell.status())); });
  router.bind("command", [&cell](const ApiRequest& request, const Reply& reply) { run_command(cell, request, reply); });
  router.bind("stop",
              [&cell](const ApiRequest& request, const Reply& reply) { reply(stop_at_once(cell, request.caller)); });
  router.bind("getBedPicture", [&cell](const ApiRequest&, const Reply& reply) {
    std::string picture = cell.bed->picture();
    if (picture.empty())
      return reply(
          ApiReply::error({ErrorCode::kNotFound, "the bed has not been photographed since the daemon started"}));
    reply(ApiReply::bytes(std::move(picture), "image/jpeg"));
  });
}

}  // namespace veneer::daemon
