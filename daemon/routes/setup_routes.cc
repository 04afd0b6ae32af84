// The way from an unpacked machine to the first cut: which devices there are and what is collected of them, a look at
// the bed at any time, and the hands of a simulated cell.
#include <fmt/format.h>

#include <algorithm>

#include "calib/april_grid.h"
#include "daemon/calibration/calibration_service.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/post_work.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json devices_json(const Config& config, const CellDevices& named) {
  return {{"scanner", {{"kind", config.scanner.kind}, {"device", named.scanner}, {"dpi", config.scanner.dpi}}},
          {"camera", {{"kind", config.camera.kind}, {"device", named.camera}}},
          {"laser", {{"kind", config.laser.kind}, {"device", named.laser}}}};
}

json setup_json(const SetupServices& s) {
  const auto collected = s.calibrations.collected();
  json heights = json::array();
  for (const Millimetres height : collected.view_heights) heights.push_back(height.count());
  const auto& travel = s.unit.limits().travel;
  return {{"schema_version", 1},
          {"devices", devices_json(s.config, s.named)},
          {"hands", s.hands != nullptr},
          {"collected", {{"grid_scans", collected.grid_scans}, {"view_heights_mm", std::move(heights)}}},
          {"travel_mm", travel.empty() ? json() : json{travel.width().count(), travel.height().count()}},
          {"panel_thickness_mm", s.config.panel.thickness.count()},
          {"calibration_days", s.config.panel.calibration_days}};
}

json sight_json(const BedSight& sight) {
  const calib::AprilGrid grid;
  json panels = json::array();
  for (const PanelId& panel : sight.panels) panels.push_back(panel.value);
  const auto of_grid = std::count_if(sight.tags.begin(), sight.tags.end(), [&](int tag) { return grid.has(tag); });
  return {{"tags", sight.tags}, {"grid_tags", of_grid}, {"grid_has", grid.tags()}, {"panels", std::move(panels)}};
}

// Its place in the camera's queue is a run's while there is one.
void look(const SetupServices& s, const Reply& reply) {
  if (const Status may = camera_is_free(s.unit); !may) return reply(ApiReply::error(may.error()));
  start_task(s.tasks, s.camera, "look at the bed", "waiting for the camera", reply, [s](const TaskReporter& task) {
    task.progress(0.1, "looking at the bed");
    const auto sight = s.bed.see();
    task.finish(sight ? Result<json>(sight_json(*sight)) : Result<json>(sight.error()));
  });
}

// ---- hands of a simulated cell --------------------------------------------------------------------------------------

Error no_hands() {
  return {ErrorCode::kConflict, "this cell is not a simulated one: its sheets are laid by people's hands"};
}

// Where hands would be caught, as at a real machine.
Status hands_may_go_in(const UnitState& unit) {
  switch (const CellState state = unit.view().state) {
    case CellState::kStopped:
    case CellState::kIdle:
    case CellState::kComplete:
    case CellState::kAborted:
    case CellState::kHeld:
      return Ok();
    case CellState::kSuspended:
      if (!unit.view().framing) return Ok();
      [[fallthrough]];
    default:
      return Error{
          ErrorCode::kConflict,
          fmt::format("the cell is {}, and its head may move: keep your hands out until it rests", to_string(state))};
  }
}

using Deed = std::function<Status(const SimHands&)>;

void play(const SetupServices& s, const ApiRequest& request, RequestReader& body, Deed deed, const Reply& reply) {
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (s.hands == nullptr) return reply(ApiReply::error(no_hands()));
  if (const Status may = hands_may_go_in(s.unit); !may) return reply(ApiReply::error(may.error()));
  s.pictures.ask(request, reply, [hands = s.hands, deed = std::move(deed)](Repositories&) {
    const Status done = deed(*hands);
    return done ? ApiReply::json({{"done", true}}) : ApiReply::error(done.error());
  });
}

void lay_sheet(const SetupServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  SheetToLay order;
  order.sheet = body.text("sheet").value_or("");
  order.on = body.word("on", {"scanner", "bed"}).value_or("");
  order.face = body.word("face", {"show", "back"}).value_or("show");
  order.part = body.word("part", {"whole", "left", "right", "bottom", "top"}).value_or("");
  order.height_mm = body.number("height_mm", ranges::kHeightAboveBed).value_or(0);
  order.turn_deg = body.number("turn_deg", ranges::kTurn);
  body.require("sheet");
  body.require("on");
  play(
      s, request, body, [order](const SimHands& hands) { return hands.lay(order); }, reply);
}

void lift_sheet(const SetupServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto from = body.word("from", {"scanner", "bed"}).value_or("");
  body.require("from");
  play(
      s, request, body, [from](const SimHands& hands) { return hands.lift(from); }, reply);
}

void move_lid(const SetupServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const bool open = body.flag("open").value_or(false);
  body.require("open");
  play(
      s, request, body, [open](const SimHands& hands) { return hands.lid(open); }, reply);
}

void make_panel(const SetupServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto name = body.text("name").value_or("");
  body.require("name");
  play(
      s, request, body, [name](const SimHands& hands) { return hands.new_panel(name); }, reply);
}

void list_sheets(const SetupServices& s, const ApiRequest& request, const Reply& reply) {
  if (s.hands == nullptr) return reply(ApiReply::error(no_hands()));
  s.pictures.ask(request, reply, [hands = s.hands](Repositories&) {
    const auto sheets = hands->sheets();
    if (!sheets) return ApiReply::error(sheets.error());
    json list = json::array();
    for (const SimSheet& sheet : *sheets)
      list.push_back({{"name", sheet.name}, {"kind", sheet.kind}, {"where", sheet.where}});
    return ApiReply::json({{"sheets", std::move(list)}});
  });
}

}  // namespace

Status camera_is_free(const UnitState& unit) {
  switch (const CellState state = unit.view().state) {
    case CellState::kStopped:
    case CellState::kResetting:
    case CellState::kIdle:
    case CellState::kComplete:
    case CellState::kAborted:
    case CellState::kClearing:
      return Ok();
    default:
      return Error{ErrorCode::kConflict,
                   fmt::format("the cell is {}, and its looks at the bed would wait until the camera is free again: "
                               "let it end, or Stop it, then try again",
                               to_string(state))};
  }
}

void bind_setup_routes(Router& router, const SetupServices& s) {
  router.bind("getSetup", [s](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(setup_json(s))); });
  router.bind("lookAtBed", [s](const ApiRequest&, const Reply& reply) { look(s, reply); });
  router.bind("laySheet", [s](const ApiRequest& request, const Reply& reply) { lay_sheet(s, request, reply); });
  router.bind("liftSheet", [s](const ApiRequest& request, const Reply& reply) { lift_sheet(s, request, reply); });
  router.bind("moveLid", [s](const ApiRequest& request, const Reply& reply) { move_lid(s, request, reply); });
  router.bind("makeSheet", [s](const ApiRequest& request, const Reply& reply) { make_panel(s, request, reply); });
  router.bind("listSheets", [s](const ApiRequest& request, const Reply& reply) { list_sheets(s, request, reply); });
}

}  // namespace veneer::daemon
