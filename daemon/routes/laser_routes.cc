// The laser on its own: test pattern, drawings, jog, overrides. What an operator needs before there is a cell around
// it.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "daemon/calibration/test_pattern.h"
#include "daemon/plans/run_strokes.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

ApiReply answer(const Status& status) {
  return status ? ApiReply::json({{"taken", true}}) : ApiReply::error(status.error());
}

struct PatternRequest {
  TestPatternOptions options;
  bool check = false;
  std::vector<std::string> confirmed;
};

Result<PatternRequest> read_pattern(const ApiRequest& asked) {
  PatternRequest request;
  auto body = RequestReader::body_of(asked);
  if (const auto size = body.number("size_mm", ranges::kPatternSide)) request.options.size = Millimetres(*size);
  const auto x = body.number("x_mm", ranges::kPlace), y = body.number("y_mm", ranges::kPlace);
  request.options.dark = body.flag("dry").value_or(false);
  request.check = body.flag("check").value_or(false);
  request.confirmed = body.texts("confirmed").value_or(std::vector<std::string>());
  if (x.has_value() != y.has_value())
    body.refuse({ErrorCode::kInvalidArgument,
                 "x_mm and y_mm are given together: give both of the pattern's lower left corner"});
  if (x && y) request.options.corner = point<MachineFrame>(*x, *y);
  if (const Status read = body.end(); !read) return read.error();
  return request;
}

// Nothing moves while a controller only reads strokes, but for the homing before it.
Status may_check(const LaserServices& s) {
  if (Status able = may_home(s.unit); !able) return able;
  return s.unit.view().state == CellState::kIdle ? Ok() : s.patterns.may_burn_pattern({}, {});
}

void burn(const LaserServices& s, const PatternRequest& request, const TaskReporter& task, const std::string& who) {
  auto strokes = make_test_pattern(s.unit.limits(), s.recipe, request.options);
  if (!strokes) return task.fail(strokes.error());
  const std::size_t count = strokes->strokes.size();
  const auto done = [task, count, request](const Status& ended) {
    if (!ended) return task.fail(ended.error());
    task.done({{"strokes", count}, {"dry", request.options.dark}, {"check", request.check}});
  };
  if (request.check) {
    task.progress(0.3, "the controller reads the pattern, nothing moves");
    return s.patterns.check_pattern(std::move(*strokes), who, done);
  }
  task.progress(0.3, request.options.dark ? "running the pattern with the beam off" : "burning the pattern");
  s.patterns.burn_pattern(std::move(*strokes), who, done, request.confirmed, [task] { return not_cancelled(task); });
}

// The command is an operator's word for all it takes: homing, then the pattern.
void test_pattern(const LaserServices& s, const ApiRequest& asked, const Reply& reply) {
  auto request = read_pattern(asked);
  if (!request) return reply(ApiReply::error(request.error()));
  const PatternWord word{asked.caller.who, request->confirmed, !request->options.dark, s.unit.consent()};
  LaserJob known;
  if (!s.unit.limits().travel.empty()) {
    auto strokes = make_test_pattern(s.unit.limits(), s.recipe, request->options);
    if (!strokes) return reply(ApiReply::error(strokes.error()));
    known = *std::move(strokes);
  }
  if (const Status may = request->check ? may_check(s) : may_begin_pattern(s.unit, s.patterns, known, word); !may)
    return reply(ApiReply::error(may.error()));
  auto task = s.tasks.start("laser test-pattern", "getting ready");
  reply(ApiReply::task(task.id()));
  const auto go_on = [s, request = *request, task, who = word.who] { burn(s, request, task, who); };
  if (request->check) return when_homed(s.unit, s.patterns, task, word.who, go_on);
  home_for_pattern(s.unit, s.patterns, task, word, [go_on](const Consent&) { go_on(); });
}

struct RunRequest {
  LaserJob job;
  std::size_t points = 0;
  bool dry = false, check = false;
  std::vector<std::string> confirmed;
};

Result<RunRequest> read_run(const ApiRequest& asked) {
  auto body = RequestReader::body_of(asked);
  const auto list = [&body](const char* name, NumberRange range, std::vector<double> otherwise) {
    return body.numbers(name, range).value_or(std::move(otherwise));
  };
  DrawnStrokes drawn;
  drawn.points_mm = list("points_mm", ranges::kPlace, {});
  drawn.points_per_stroke = list("strokes", ranges::kPointsOfStroke, {});
  drawn.speeds_mm_s = list("speeds_mm_s", ranges::kSpeed, {});
  drawn.powers = list("powers", ranges::kPower, {});
  drawn.passes = list("passes", ranges::kPasses, {1});
  drawn.air = list("air", ranges::kSwitch, {0});
  RunRequest run;
  run.dry = body.flag("dry").value_or(false);
  run.check = body.flag("check").value_or(false);
  run.confirmed = body.texts("confirmed").value_or(std::vector<std::string>());
  for (const char* needed : {"points_mm", "strokes", "speeds_mm_s", "powers"}) body.require(needed);
  if (const Status read = body.end(); !read) return read.error();
  auto job = job_of_strokes(drawn, run.dry);
  if (!job) return job.error();
  run.job = std::move(*job);
  run.points = drawn.points_mm.size() / 2;
  return run;
}

void burn_run(const LaserServices& s, RunRequest run, const TaskReporter& task, const std::string& who) {
  if (const Status fits = check_fits(run.job, s.unit.limits()); !fits) return task.fail(fits.error());
  nlohmann::json result = {
      {"points", run.points}, {"length_mm", length_of(run.job).count()}, {"dry", run.dry}, {"check", run.check}};
  return_to_corner(run.job, s.unit.limits(), s.recipe.engrave_speed);
  const auto done = [task, result = std::move(result), begin = SteadyClock().now()](const Status& ended) {
    if (!ended) return task.fail(ended.error());
    nlohmann::json timed = result;
    timed["seconds"] = std::chrono::duration<double>(SteadyClock().now() - begin).count();
    task.done(timed);
  };
  if (run.check) {
    task.progress(0.3, "the controller reads it, nothing moves");
    return s.patterns.check_pattern(std::move(run.job), who, done);
  }
  task.progress(0.3, run.dry ? "running it with the beam off" : "burning it");
  s.patterns.burn_pattern({std::move(run.job), "drawing"}, who, done, run.confirmed,
                          [task] { return not_cancelled(task); });
}

void begin_run(const LaserServices& s, RunRequest run, const std::string& who, const Reply& reply) {
  const PatternWord word{who, run.confirmed, !run.dry, s.unit.consent()};
  const LaserLimits& limits = s.unit.limits();
  if (const Status fits = limits.travel.empty() ? Ok() : check_fits(run.job, limits); !fits)
    return reply(ApiReply::error(fits.error()));
  if (const Status may = run.check ? may_check(s) : may_begin_pattern(s.unit, s.patterns, run.job, word); !may)
    return reply(ApiReply::error(may.error()));
  auto task = s.tasks.start("laser run", "getting ready");
  reply(ApiReply::task(task.id()));
  const bool checks = run.check;
  const auto go_on = [s, run = std::make_shared<RunRequest>(std::move(run)), task, who] {
    burn_run(s, std::move(*run), task, who);
  };
  if (checks) return when_homed(s.unit, s.patterns, task, who, go_on);
  home_for_pattern(s.unit, s.patterns, task, word, [go_on](const Consent&) { go_on(); });
}

// A dense drawing is megabytes: only a small one is read here.
void run_strokes(const LaserServices& s, const ApiRequest& asked, const Reply& reply) {
  const auto go_on = [s, who = asked.caller.who, reply](Result<RunRequest> run) {
    if (!run) return reply(ApiReply::error(run.error()));
    begin_run(s, std::move(*run), who, reply);
  };
  if (asked.body.size() <= kSmallBody) return go_on(read_run(asked));
  const auto no_room = [reply](ApiReply made) {
    if (made.status >= 400) reply(std::move(made));
  };
  // Reading takes its time, and what was confirmed was said of the bed as it lay before.
  s.pictures.ask(asked, no_room, [s, asked, go_on, given = s.unit.consent()](Repositories&) {
    auto run = std::make_shared<Result<RunRequest>>(read_run(asked));
    s.on_reactor([s, run, go_on, given] {
      if (const Status holds = s.unit.still_holds(given); *run && !(*run)->dry && !(*run)->check && !holds)
        return go_on(holds.error());
      go_on(std::move(*run));
    });
    return ApiReply::json(nlohmann::json::object());
  });
}

void jog(const LaserServices& s, const ApiRequest& asked, const Reply& reply) {
  auto body = RequestReader::body_of(asked);
  const auto dx = body.number("dx_mm", ranges::kPlace), dy = body.number("dy_mm", ranges::kPlace);
  const auto speed = body.number("speed_mm_s", ranges::kJogSpeed);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  s.jogging.jog(Millimetres(dx.value_or(0)), Millimetres(dy.value_or(0)), MmPerSecond(speed.value_or(50)),
                asked.caller.who, [reply](const Status& taken) { reply(answer(taken)); });
}

void set_overrides(const LaserServices& s, const ApiRequest& asked, const Reply& reply) {
  auto body = RequestReader::body_of(asked);
  const auto feed = body.whole("feed", ranges::kFeedOverride), rapid = body.whole("rapid", ranges::kRapidOverride),
             power = body.whole("power", ranges::kPowerOverride);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  // What is not named stays as it was asked for last: the machine may still be on its way there.
  LaserOverrides wanted = s.overrides.wanted();
  if (feed) wanted.feed = static_cast<int>(*feed);
  if (rapid) wanted.rapid = static_cast<int>(*rapid);
  if (power) wanted.power = static_cast<int>(*power);
  if (const Status set = s.overrides.set(wanted); !set) return reply(ApiReply::error(set.error()));
  reply(ApiReply::json(
      {{"taken", true},
       {"overrides_wanted", {{"feed", wanted.feed}, {"rapid", wanted.rapid}, {"power", wanted.power}}}}));
}

}  // namespace

void bind_laser_routes(Router& router, const LaserServices& s) {
  router.bind("laserTestPattern",
              [s](const ApiRequest& request, const Reply& reply) { test_pattern(s, request, reply); });
  router.bind("laserRun", [s](const ApiRequest& request, const Reply& reply) { run_strokes(s, request, reply); });
  router.bind("laserCorner", [s](const ApiRequest&, const Reply& reply) { reply(answer(s.jogging.corner_is_here())); });
  router.bind("laserJog", [s](const ApiRequest& request, const Reply& reply) { jog(s, request, reply); });
  router.bind("laserJogStop", [s](const ApiRequest&, const Reply& reply) {
    s.jogging.stop();
    reply(answer(Ok()));
  });
  router.bind("laserOverrides",
              [s](const ApiRequest& request, const Reply& reply) { set_overrides(s, request, reply); });
}

}  // namespace veneer::daemon
