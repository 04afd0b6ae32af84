#include <fmt/format.h>

#include <utility>

#include "base/clock.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

ApiReply taken(const UnitState& unit) {
  return ApiReply::json({{"state", to_string(unit.view().state)}, {"reason", unit.view().reason}});
}

CellCommands::Reply reply_with_state(const UnitState& unit, Reply reply) {
  return [&unit, reply = std::move(reply)](const Status& done) {
    reply(done ? taken(unit) : ApiReply::error(done.error()));
  };
}

Error no_such_command(const std::string& word) {
  return {ErrorCode::kNotFound, fmt::format("there is no command {}: use hold, unhold, unsuspend, frame, stop, abort, "
                                            "clear, reset, stop-after-piece or write-off-look",
                                            word)};
}

// What the operator confirms belongs to where the beam comes on, the power to the frame.
void run_command(const UnitServices& s, const ApiRequest& request, const Reply& reply) {
  const std::string& word = request.path_param("command");
  auto body = RequestReader::body_of(request);
  auto confirmed = body.texts("confirmed");
  const auto power = body.number("power", ranges::kPower);
  if (confirmed && word != "unsuspend" && word != "frame")
    body.refuse({ErrorCode::kInvalidArgument, fmt::format("confirmed is not for {}: leave it out", word)});
  if (power && word != "frame")
    body.refuse({ErrorCode::kInvalidArgument, fmt::format("power is not for {}: leave it out", word)});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  auto with_state = reply_with_state(s.unit, reply);
  const std::string& who = request.caller.who;
  if (word == "stop-after-piece") return s.commands.stop_after_piece(who, with_state);
  if (word == "write-off-look") return s.commands.write_off_look(who, with_state);
  if (word == "frame")
    return s.commands.frame(PowerFraction(power.value_or(0)), who, with_state,
                            std::move(confirmed).value_or(std::vector<std::string>()));
  const auto command = command_from_string(word);
  if (!command || *command == CellCommand::kStart || *command == CellCommand::kRecut)
    return reply(ApiReply::error(no_such_command(word)));
  s.commands.command(*command, who, std::move(with_state), std::move(confirmed).value_or(std::vector<std::string>()));
}

// Large, and made elsewhere: copied beside the reactor, where it gets its ETag too. `made` may be called from any
// thread.
void reply_large(const UnitServices& s, const ApiRequest& request, const Reply& reply,
                 std::function<std::string()> made, const std::string& content_type, const char* none_yet) {
  s.queries.ask(request, reply, [made = std::move(made), content_type, none_yet](Repositories&) {
    std::string bytes = made();
    return bytes.empty() ? ApiReply::error({ErrorCode::kNotFound, none_yet})
                         : ApiReply::bytes(std::move(bytes), content_type);
  });
}

// Whoever only looks on is told why there may be none now, and not where the camera's pictures lie.
Error told_to(Role role, const Error& error) {
  if (role >= Role::kOperator || error.code == ErrorCode::kConflict) return error;
  return {error.code, "the camera gives no picture; an operator is told why"};
}

// The age is asked for anew each time; a client that has the picture learns it too.
void glance(const UnitServices& s, const ApiRequest& request, const Reply& reply) {
  s.glances.ask(request.gone, [s, request, reply](const Result<BedGlances::Picture>& seen) {
    if (!seen) return reply(ApiReply::error(told_to(request.caller.role, seen.error())));
    const auto age = std::chrono::duration_cast<std::chrono::seconds>(s.glances.age(**seen));
    s.queries.ask(request, reply, [picture = *seen, age](Repositories&) {
      ApiReply out = ApiReply::bytes(picture->jpeg, "image/jpeg");
      out.headers.emplace_back("Age", std::to_string(age.count()));
      return out;
    });
  });
}

}  // namespace

ApiReply stop_at_once(CellCommands& commands, const UnitState& unit, Metrics& metrics, const WhoAsks& who_asks) {
  const SteadyClock clock;
  const auto read = clock.now();
  commands.stop_by([&who_asks] { return who_asks().who; });
  metrics.stop_taken(commands.stop_given() - read);
  return taken(unit);
}

void bind_unit_routes(Router& router, const UnitServices& s) {
  router.bind("getStatus", [s](const ApiRequest& request, const Reply& reply) {
    reply(ApiReply::json(s.status(request.caller.role)));
  });
  router.bind("command", [s](const ApiRequest& request, const Reply& reply) { run_command(s, request, reply); });
  router.bind("stop", [s](const ApiRequest& request, const Reply& reply) {
    reply(stop_at_once(s.commands, s.unit, s.metrics, [&request]() -> const Caller& { return request.caller; }));
  });
  router.bind("getBedPicture", [s](const ApiRequest& request, const Reply& reply) {
    reply_large(
        s, request, reply, [&bed = s.bed] { return bed.picture(); }, "image/jpeg",
        "the bed has not been photographed since the daemon started: look at it with `veneerctl bed look`");
  });
  router.bind("getBedGlance", [s](const ApiRequest& request, const Reply& reply) { glance(s, request, reply); });
  router.bind("getBedToolpath", [s](const ApiRequest& request, const Reply& reply) {
    reply_large(
        s, request, reply, [&cuts = s.cuts] { return cuts.toolpath(); }, "application/json",
        "no toolpath was drawn yet: start a job and lay its panel");
  });
  router.bind("checkIntegrity", [s](const ApiRequest&, const Reply& reply) {
    const auto task = s.integrity.on_demand(s.tasks);
    reply(task ? ApiReply::task(*task) : ApiReply::error(task.error()));
  });
}

}  // namespace veneer::daemon
