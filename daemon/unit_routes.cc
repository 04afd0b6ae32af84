#include <fmt/format.h>

#include <algorithm>

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

// {"power": 0.02}; dark without it.
void frame(Cell& cell, const ApiRequest& request, const nlohmann::json& body, const Reply& reply) {
  double power = 0;
  if (const auto it = body.find("power"); it != body.end()) {
    if (!it->is_number())
      return reply(ApiReply::error({ErrorCode::kInvalidArgument, "power must be a number from 0 to 1"}));
    power = it->get<double>();
  }
  cell.runner->frame(PowerFraction(power), request.caller.who, reply_with_state(cell, reply));
}

void run_command(Cell& cell, const ApiRequest& request, const Reply& reply) {
  const std::string& word = request.path_param("command");
  if (word == "stop-after-piece")
    return cell.runner->stop_after_piece(request.caller.who, reply_with_state(cell, reply));
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  if (word == "frame") return frame(cell, request, *body, reply);
  auto confirmed = confirmed_in(*body);
  if (!confirmed) return reply(ApiReply::error(confirmed.error()));
  const auto command = command_from_string(word);
  if (!command || *command == CellCommand::kStart || *command == CellCommand::kSuspend ||
      *command == CellCommand::kComplete || *command == CellCommand::kRecut)
    return reply(ApiReply::error(
        {ErrorCode::kNotFound, fmt::format("there is no command {}: use hold, unhold, unsuspend, frame, stop, abort, "
                                           "clear, reset or stop-after-piece",
                                           word)}));
  cell.runner->command(*command, request.caller.who, reply_with_state(cell, reply), std::move(*confirmed));
}

}  // namespace

Result<std::vector<std::string>> confirmed_in(const nlohmann::json& body) { return texts_in(body, "confirmed"); }

Result<std::vector<std::string>> texts_in(const nlohmann::json& body, const char* name) {
  std::vector<std::string> out;
  const auto it = body.find(name);
  if (it == body.end()) return out;
  const bool texts = it->is_array() && std::all_of(it->begin(), it->end(), [](const auto& t) { return t.is_string(); });
  if (!texts) return Error{ErrorCode::kInvalidArgument, fmt::format("{} must be a list of texts", name)};
  return it->get<std::vector<std::string>>();
}

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
  router.bind("getBedToolpath", [&cell](const ApiRequest&, const Reply& reply) {
    std::string drawn = cell.bed->toolpath();
    if (drawn.empty())
      return reply(ApiReply::error({ErrorCode::kNotFound, "no toolpath was drawn yet: start a job and lay its panel"}));
    reply(ApiReply::bytes(std::move(drawn), "application/json"));
  });
}

}  // namespace veneer::daemon
