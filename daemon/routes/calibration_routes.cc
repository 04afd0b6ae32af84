// Calibrations and the certificates they leave.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/post_work.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

void finish_calibration(const CalibrationServices& s, const TaskReporter& task,
                        const Result<CalibrationOutcome>& outcome) {
  s.on_calibrated();
  task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
}

// Burns on the reactor, then photographs and fits on the camera's worker.
void burn_and_measure(const CalibrationServices& s, const TaskReporter& task, const PatternBoard& board,
                      const std::string& who, std::vector<std::string> confirmed) {
  const Box<MachineFrame> travel = s.unit.limits().travel;
  auto strokes = s.calibrations.pattern_for(travel, board);
  if (!strokes) return task.fail(strokes.error());
  task.progress(0.05, "burning the pattern");
  const auto photograph = [s, task, travel, board](const Status& burnt) {
    if (!burnt) return task.fail(burnt.error());
    s.calibrations.note_burnt(travel, board);
    post_task(s.camera, task, [s, task, thickness = board.thickness] {
      finish_calibration(
          s, task,
          s.calibrations.axes(
              thickness, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token()));
    });
  };
  s.patterns.burn_pattern(std::move(*strokes), who, photograph, std::move(confirmed),
                          [task] { return not_cancelled(task); });
}

// What a laser's calibration was asked for, and by whom.
struct PatternOrder {
  PatternBoard board;
  std::string who;
  std::vector<std::string> confirmed;
};

// Looks on the camera's worker before anything moves or is burnt. That takes its time, and what was confirmed was said
// of the bed as it lay before: `given`.
void look_first(const CalibrationServices& s, const TaskReporter& task, const PatternOrder& order, const Consent& given,
                std::function<void()> then) {
  post_task(s.camera, task,
            [s, task, board = order.board, given, travel = s.unit.limits().travel, then = std::move(then)]() mutable {
              const Status ready = s.calibrations.ready_for_pattern(
                  travel, board, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
              // A look that was cancelled may fail as well.
              const Status wanted = not_cancelled(task);
              if (!wanted || !ready) return task.fail(wanted ? ready.error() : wanted.error());
              s.on_reactor([s, task, given, then = std::move(then)] {
                if (const Status still = still_wanted(s.unit, task, given); !still) return task.fail(still.error());
                then();
              });
            });
}

void burn_where_it_lies(const CalibrationServices& s, const TaskReporter& task, const PatternOrder& order,
                        const Consent& given) {
  look_first(s, task, order, given,
             [s, task, order] { burn_and_measure(s, task, order.board, order.who, order.confirmed); });
}

// The laser is not homed for a bed on which nothing could be burnt. Homing takes its time, the head may have stood in
// the picture, and only then is it known where the middle of the bed is: so the camera looks once more after it.
void home_and_burn(const CalibrationServices& s, const TaskReporter& task, const PatternOrder& order,
                   const Consent& given) {
  look_first(s, task, order, given, [s, task, order, given] {
    home_for_pattern(s.unit, s.patterns, task, {order.who, order.confirmed, true, given},
                     [s, task, order](const Consent& homed) { burn_where_it_lies(s, task, order, homed); });
  });
}

// The request is an operator's word for all it takes: homing, then the pattern.
void calibrate_laser(const CalibrationServices& s, const PatternOrder& order, const std::string& kind,
                     const std::string& waiting, const Reply& reply) {
  const auto strokes = s.calibrations.pattern_for(s.unit.limits().travel, order.board);
  if (!strokes) return reply(ApiReply::error(strokes.error()));
  if (const Status able = may_home(s.unit); !able) return reply(ApiReply::error(able.error()));
  if (const Status may = s.patterns.may_burn_pattern(*strokes, order.confirmed); !may)
    return reply(ApiReply::error(may.error()));
  const TaskReporter task = s.tasks.start(kind, waiting);
  reply(ApiReply::task(task.id()));
  const Consent given = s.unit.consent();
  if (s.unit.view().state == CellState::kIdle) return burn_where_it_lies(s, task, order, given);
  home_and_burn(s, task, order, given);
}

void calibrate(const CalibrationServices& s, const ApiRequest& request, const Reply& reply) {
  const std::string& device = request.path_param("device");
  auto body = RequestReader::body_of(request);
  const bool more = body.flag("more").value_or(false);
  const Millimetres height(
      body.number("height_mm", ranges::kHeightAboveBed).value_or(device == "laser" ? s.thickness.count() : 0.0));
  PatternBoard board{height, {}, {}};
  if (const auto side = body.number("board_width_mm", ranges::kBoardSide)) board.width = Millimetres(*side);
  if (const auto side = body.number("board_height_mm", ranges::kBoardSide)) board.height = Millimetres(*side);
  auto confirmed = body.texts("confirmed").value_or(std::vector<std::string>());
  board = with_confirmed(board, confirmed);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (device != "scanner" && device != "camera" && device != "laser" && device != "kerf")
    return reply(ApiReply::error(
        {ErrorCode::kNotFound,
         fmt::format("nothing to calibrate is called {}: use scanner, camera, laser or kerf", device)}));
  const std::string kind = "calibrate " + device, waiting = "waiting for the device";
  if (device == "laser")
    return calibrate_laser(s, {board, request.caller.who, std::move(confirmed)}, kind, waiting, reply);
  if (const Status may = device == "camera" ? camera_is_free(s.unit) : Ok(); !may)
    return reply(ApiReply::error(may.error()));
  Worker& worker = device == "camera" ? s.camera : s.scanner;
  start_task(s.tasks, worker, kind, waiting, reply, [s, device, more, height](const TaskReporter& task) {
    const auto progress = [&](double f, const std::string& text) { task.progress(f, text); };
    finish_calibration(s, task,
                       device == "scanner"  ? s.calibrations.scanner(more, progress, task.stop_token())
                       : device == "camera" ? s.calibrations.camera(more, height, progress, task.stop_token())
                                            : s.calibrations.kerf(progress, task.stop_token()));
  });
}

constexpr std::chrono::hours kSoon(7 * 24);  // before it expires

Result<json> certificates_json(Repositories& r, const Page& page) {
  auto list = judged_certificates(r, utc_timestamp(), {page.after}, page.limit + 1, utc_timestamp(kSoon));
  if (!list) return list.error();
  json out = {{"certificates", json::array()}};
  out["next"] = cut_to_page(*list, page, [](const JudgedCertificate& judged) { return judged.record.id.value; });
  for (const auto& certificate : *list) out["certificates"].push_back(to_json(certificate));
  return out;
}

// In the frame of the certificate, of which the error is asked there.
struct AskedPoint {
  double x = 0, y = 0;
};

Result<json> certificate_json(Repositories& r, CertificateId id, const std::optional<AskedPoint>& place) {
  const Error none{ErrorCode::kNotFound,
                   fmt::format("there is no certificate {}: veneerctl certificates lists them", id.value)};
  if (id.value == std::numeric_limits<decltype(id.value)>::max()) return none;  // the list counts from the next one
  auto found = judged_certificates(r, utc_timestamp(), {id.value + 1}, 1, utc_timestamp(kSoon));
  if (!found) return found.error();
  if (found->empty() || found->front().record.id != id) return none;
  json out = {{"certificate", to_json(found->front())}};
  if (!place) return out;
  const auto error = error_at(found->front().record, place->x, place->y);
  if (!error) return error.error();
  json& at = out["at"] = {{"x_mm", place->x}, {"y_mm", place->y}};
  at["frame"] = error->frame.empty() ? json() : json(error->frame);
  at["predicted_error_mm"] = error->predicted ? json(error->predicted->sigma.count()) : json();
  at["to_measured_mm"] = error->predicted ? json(error->predicted->to_measured.count()) : json();
  if (!error->predicted) at["not_predicted"] = error->not_predicted;
  return out;
}

void reply_certificate(const CalibrationServices& s, const ApiRequest& request, const Reply& reply) {
  const auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto query = RequestReader::query_of(request);
  const auto x = query.number("x", ranges::kPlace), y = query.number("y", ranges::kPlace);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  if (x.has_value() != y.has_value())
    return reply(ApiReply::error(
        {ErrorCode::kInvalidArgument, "a place on the glass or the bed has two numbers: give x and y, both in mm"}));
  std::optional<AskedPoint> place;
  if (x) place = AskedPoint{*x, *y};
  reply_from_query(
      s.queries, request, [id = CertificateId{*id}, place](Repositories& r) { return certificate_json(r, id, place); },
      reply);
}

}  // namespace

void bind_calibration_routes(Router& router, const CalibrationServices& s) {
  router.bind("calibrate", [s](const ApiRequest& request, const Reply& reply) { calibrate(s, request, reply); });
  router.bind("getCertificate",
              [s](const ApiRequest& request, const Reply& reply) { reply_certificate(s, request, reply); });
  router.bind("listCertificates", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request, [page](Repositories& r) { return certificates_json(r, page); }, reply);
  });
}

}  // namespace veneer::daemon
