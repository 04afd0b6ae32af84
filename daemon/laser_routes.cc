// The laser on its own: test pattern, jog, overrides. What an operator needs before there is a cell around it.
#include <fmt/format.h>

#include <optional>

#include "daemon/cell_routes.h"
#include "daemon/test_pattern.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// A number of the request's body; nullopt when it is not there.
Result<std::optional<double>> number(const json& body, const char* name) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null()) return std::optional<double>{};
  if (!it->is_number()) return Error{ErrorCode::kInvalidArgument, fmt::format("{} must be a number", name)};
  return std::optional(it->get<double>());
}

Result<bool> flag(const json& body, const char* name) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null()) return false;
  if (!it->is_boolean()) return Error{ErrorCode::kInvalidArgument, fmt::format("{} must be true or false", name)};
  return it->get<bool>();
}

ApiReply answer(const Status& status) {
  return status ? ApiReply::json({{"taken", true}}) : ApiReply::error(status.error());
}

struct PatternRequest {
  TestPatternOptions options;
  bool check = false;
  std::vector<std::string> confirmed;
};

Result<PatternRequest> read_pattern(const json& body) {
  PatternRequest request;
  const auto size = number(body, "size_mm"), x = number(body, "x_mm"), y = number(body, "y_mm");
  const auto dry = flag(body, "dry"), check = flag(body, "check");
  for (const auto* value : {&size, &x, &y})
    if (!value->ok()) return value->error();
  for (const auto* value : {&dry, &check})
    if (!value->ok()) return value->error();
  auto confirmed = confirmed_in(body);
  if (!confirmed) return confirmed.error();
  request.confirmed = std::move(*confirmed);
  if (*size) request.options.size = Millimetres(**size);
  if (x->has_value() != y->has_value())
    return Error{ErrorCode::kInvalidArgument, "x_mm and y_mm are given together: the pattern's lower left corner"};
  if (*x) request.options.corner = point<MachineFrame>(**x, **y);
  request.options.dark = *dry;
  request.check = *check;
  return request;
}

void burn(Cell& cell, const PatternRequest& request, const TaskReporter& task, const std::string& who) {
  auto strokes = make_test_pattern(cell.runner->limits(), cell.config.recipe, request.options);
  if (!strokes) return task.fail(strokes.error());
  const std::size_t count = strokes->strokes.size();
  const auto done = [task, count, request](const Status& ended) {
    if (!ended) return task.fail(ended.error());
    task.done({{"strokes", count}, {"dry", request.options.dark}, {"check", request.check}});
  };
  if (request.check) {
    task.progress(0.3, "the controller reads the pattern, nothing moves");
    return cell.runner->check_pattern(std::move(*strokes), who, done);
  }
  task.progress(0.3, request.options.dark ? "running the pattern with the beam off" : "burning the pattern");
  cell.runner->burn_pattern(std::move(*strokes), who, done, request.confirmed);
}

// The command is an operator's word for all it takes: homing, then the pattern.
void test_pattern(Cell& cell, const ApiRequest& asked, const Reply& reply) {
  auto body = asked.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  auto request = read_pattern(*body);
  if (!request) return reply(ApiReply::error(request.error()));
  // Before the machine homes for nothing.
  const bool burns = !request->options.dark && !request->check;
  if (const Status given = burns ? cell.runner->require_confirmed(request->confirmed) : Ok(); !given)
    return reply(ApiReply::error(given.error()));
  auto task = cell.tasks.start("laser test-pattern", "getting ready");
  reply(ApiReply::task(task.id()));
  const std::string who = asked.caller.who;
  if (cell.runner->view().state == CellState::kIdle) return burn(cell, *request, task, who);
  task.progress(0.1, "homing the laser");
  cell.runner->command(CellCommand::kReset, who, [&cell, request = *request, task, who](const Status& homed) {
    if (!homed) return task.fail(homed.error());
    burn(cell, request, task, who);
  });
}

void jog(Cell& cell, const ApiRequest& asked, const Reply& reply) {
  auto body = asked.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const auto dx = number(*body, "dx_mm"), dy = number(*body, "dy_mm"), speed = number(*body, "speed_mm_s");
  for (const auto* value : {&dx, &dy, &speed})
    if (!value->ok()) return reply(ApiReply::error(value->error()));
  reply(answer(cell.runner->jog(Millimetres(dx->value_or(0)), Millimetres(dy->value_or(0)),
                                MmPerSecond(speed->value_or(50)), asked.caller.who)));
}

void set_overrides(Cell& cell, const ApiRequest& asked, const Reply& reply) {
  auto body = asked.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  LaserOverrides wanted = cell.devices.laser->status().overrides;
  for (const auto& [name, value] :
       {std::pair("feed", &wanted.feed), {"rapid", &wanted.rapid}, {"power", &wanted.power}}) {
    const auto percent = number(*body, name);
    if (!percent) return reply(ApiReply::error(percent.error()));
    if (*percent) *value = static_cast<int>(std::clamp(**percent, -1e6, 1e6));
  }
  reply(answer(cell.devices.laser->set_overrides(wanted)));
}

}  // namespace

void bind_laser_routes(Router& router, Cell& cell) {
  router.bind("laserTestPattern",
              [&cell](const ApiRequest& request, const Reply& reply) { test_pattern(cell, request, reply); });
  router.bind("laserJog", [&cell](const ApiRequest& request, const Reply& reply) { jog(cell, request, reply); });
  router.bind("laserJogStop", [&cell](const ApiRequest&, const Reply& reply) {
    cell.devices.laser->stop_jog();
    reply(answer(Ok()));
  });
  router.bind("laserOverrides",
              [&cell](const ApiRequest& request, const Reply& reply) { set_overrides(cell, request, reply); });
}

}  // namespace veneer::daemon
