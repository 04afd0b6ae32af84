#include <fmt/format.h>

#include <limits>
#include <map>

#include "base/clock.h"
#include "daemon/cell_json.h"
#include "daemon/cell_routes.h"
#include "daemon/panel_wood.h"
#include "daemon/picture_reply.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// A field of a request's body, or its default; kInvalidArgument when it has another type.
template <class T>
Result<T> field(const json& body, const char* name, T otherwise) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null()) return otherwise;
  constexpr bool kText = std::is_same_v<T, std::string>, kTruth = std::is_same_v<T, bool>;
  if (kText ? it->is_string() : kTruth ? it->is_boolean() : it->is_number()) return it->template get<T>();
  return Error{ErrorCode::kInvalidArgument, fmt::format("{} must be {}", name,
                                                        kText    ? "a text"
                                                        : kTruth ? "true or false"
                                                                 : "a number")};
}

template <class T>
const Error* error_of(const Result<T>& result) {
  return result ? nullptr : &result.error();
}

// Answers from the database: `work` runs on its thread and gives JSON or an error.
template <class F>
void reply_from_database(Cell& cell, F work, Reply reply) {
  cell.database->async(std::move(work), [reply = std::move(reply)](const Result<json>& result) {
    reply(result ? ApiReply::json(*result) : ApiReply::error(result.error()));
  });
}

Result<PanelFigures> figures_of(Repositories& r, const PanelLibrary& library, const db::PanelRecord& panel) {
  PanelFigures figures;
  auto live = r.ledger.live_allocations(panel.id);
  if (!live) return live.error();
  for (const auto& a : *live) {
    const double area = a.area.area().count();
    (a.state == db::AllocationState::kCut || a.state == db::AllocationState::kScrap ? figures.cut : figures.reserved) +=
        area;
    ++figures.pieces;
  }
  auto fiducials = r.panels.fiducials(panel.id);
  if (!fiducials) return fiducials.error();
  for (const auto& f : *fiducials) figures.back_known |= f.face == db::PanelFace::kBack;
  auto scans = r.panels.scans(panel.id);
  if (!scans) return scans.error();
  if (!scans->empty()) figures.rms = scans->back().rms;
  auto usable = library.usable_area(panel);
  if (!usable) return usable.error();
  figures.usable = usable->count();
  return figures;
}

Result<json> panel_json(Repositories& r, const PanelLibrary& library, const PanelId& id) {
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  auto figures = figures_of(r, library, *panel);
  if (!figures) return figures.error();
  json out = to_json(*panel, *figures);
  auto fiducials = r.panels.fiducials(id);
  if (!fiducials) return fiducials.error();
  auto zones = r.materials.zones(id);
  if (!zones) return zones.error();
  out["zones"] = to_json(*zones);
  out["fiducials"] = json::array();
  for (const auto& f : *fiducials) {
    json centre = {0.0, 0.0};
    for (const auto& corner : f.corners) {
      const double n = static_cast<double>(f.corners.size());
      centre[0] = centre[0].get<double>() + corner.x.count() / n;
      centre[1] = centre[1].get<double>() + corner.y.count() / n;
    }
    out["fiducials"].push_back({{"kind", db::to_string(f.kind)},
                                {"tag_id", f.kind == db::FiducialKind::kTag ? json(f.tag_id) : json()},
                                {"face", db::to_string(f.face)},
                                {"centre_mm", centre},
                                {"corners_mm", points_json(f.corners)}});
  }
  return out;
}

Result<json> registration_json(Repositories& r, const PanelId& id) {
  if (auto panel = r.panels.find(id); !panel) return panel.error();
  auto scans = r.panels.scans(id);
  if (!scans) return scans.error();
  json out = {{"panel", id.value}, {"rms_mm", nullptr}, {"max_mm", nullptr}, {"scans", json::array()}};
  for (const auto& scan : *scans) {
    const json rms = scan.rms ? json(scan.rms->count()) : json(), max = scan.max ? json(scan.max->count()) : json();
    if (scan.face == db::PanelFace::kShow) out["rms_mm"] = rms, out["max_mm"] = max;
    out["scans"].push_back({{"id", scan.id.value},
                            {"face", db::to_string(scan.face)},
                            {"device", scan.device},
                            {"sha256", scan.sha256},
                            {"dpi", scan.dpi},
                            {"taken", scan.taken_at},
                            {"rms_mm", rms},
                            {"max_mm", max},
                            {"lattice", json::parse(scan.lattice, nullptr, false)}});
  }
  return out;
}

Result<json> ledger_json(Repositories& r, const PanelId& id) {
  if (auto panel = r.panels.find(id); !panel) return panel.error();
  auto all = r.ledger.all_allocations(id);
  if (!all) return all.error();
  std::map<JobId, std::map<PieceId, std::string>> marks;
  json out = {{"panel", id.value}, {"allocations", json::array()}};
  for (const auto& a : *all) {
    if (a.job.value != 0 && !marks.contains(a.job)) {
      auto pieces = r.jobs.pieces(a.job);
      if (!pieces) return pieces.error();
      for (const auto& piece : *pieces) marks[a.job][piece.id] = piece.mark;
    }
    out["allocations"].push_back(to_json(a, marks[a.job][a.piece]));
  }
  return out;
}

// Pictures take a while: read and drawn on a worker of their own, neither on the reactor nor behind a plan.
void reply_picture(Cell& cell, const ApiRequest& request, Reply reply, bool stock) {
  const PanelId id{request.path_param("id")};
  auto width = request.query_number("width");
  if (!width) return reply(ApiReply::error(width.error()));
  cell.picture_worker->post([&cell, id, width = *width, stock, reply = std::move(reply)] {
    struct Held {
      db::PanelRecord panel;
      std::vector<db::AllocationRecord> live;
    };
    auto held = cell.database->call([&](Repositories& r) -> Result<Held> {
      auto panel = r.panels.find(id);
      if (!panel) return panel.error();
      auto live = r.ledger.live_allocations(id);
      if (!live) return live.error();
      return Held{std::move(*panel), std::move(*live)};
    });
    if (!held) return reply(ApiReply::error(held.error()));
    const int shown = shown_width(width, stock ? 1600 : std::numeric_limits<int>::max());
    auto map = cell.panel_library.load_small(held->panel.map_file, shown);
    if (!map) return reply(ApiReply::error(map.error()));
    if (!stock) return reply(png_reply(map->pixels));
    auto mask = cell.panel_library.load_small(held->panel.mask_file, shown);
    if (!mask) return reply(ApiReply::error(mask.error()));
    const Raster<PanelFrame> wood{map->pixels, {kMapResolution.px_per_mm * map->scale}, {}};
    reply(png_reply(draw_stock(wood, mask->pixels, held->live)));
  });
}

void scan(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  ScanRequest wanted;
  const auto face = field<std::string>(*body, "face", "show");
  const auto panel = field<std::string>(*body, "panel", "");
  const auto more = field<bool>(*body, "more", false);
  for (const Error* wrong : {error_of(face), error_of(panel), error_of(more)})
    if (wrong != nullptr) return reply(ApiReply::error(*wrong));
  if (*face != "show" && *face != "back")
    return reply(ApiReply::error({ErrorCode::kInvalidArgument, "face must be \"show\" or \"back\""}));
  wanted.face = *face == "show" ? calib::Face::kShow : calib::Face::kBack;
  if (!panel->empty()) wanted.panel = PanelId{*panel};
  wanted.more = *more;
  auto task = cell.tasks.start("scan", "waiting for the scanner");
  cell.scanner_worker->post([&cell, task, wanted] {
    auto outcome = cell.scans->add_tile(
        wanted, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
    boost::asio::post(cell.reactor, [&cell, panel = outcome && outcome->panel ? outcome->panel->value : std::string()] {
      cell.refresh_counts();
      if (!panel.empty()) cell.hub.broadcast({{"type", "panel"}, {"panel", panel}});
    });
    task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
  });
  reply(ApiReply::task(task.id()));
}

void finish_calibration(Cell& cell, const TaskReporter& task, const Result<CalibrationOutcome>& outcome) {
  boost::asio::post(cell.reactor, [&cell] { cell.refresh_counts(); });
  task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
}

// The bare board on the bed, as the operator measured it; width and height 0 = not said.
struct Board {
  Millimetres thickness, width, height;
};

// Burns on the reactor, then photographs and fits on the camera's worker.
void calibrate_laser(Cell& cell, const TaskReporter& task, const Board& board, const std::string& who,
                     std::vector<std::string> confirmed) {
  const auto& travel = cell.runner->limits().travel;
  if (travel.empty()) return task.fail({ErrorCode::kConflict, "the laser is not connected yet: Reset the cell first"});
  const Millimetres full(30);  // without a word about the board it nearly fills the bed
  auto strokes =
      cell.calibrations->pattern_job(travel, board.width > Millimetres(0) ? board.width : travel.width() - full,
                                     board.height > Millimetres(0) ? board.height : travel.height() - full);
  if (!strokes) return task.fail(strokes.error());
  task.progress(0.05, "burning the pattern");
  const auto photograph = [&cell, task, thickness = board.thickness](const Status& burnt) {
    if (!burnt) return task.fail(burnt.error());
    cell.camera_worker->post([&cell, task, thickness] {
      finish_calibration(cell, task, cell.calibrations->axes(thickness, [&](double f, const std::string& text) {
        task.progress(f, text);
      }));
    });
  };
  cell.runner->burn_pattern(std::move(*strokes), who, photograph, std::move(confirmed));
}

void calibrate(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const std::string& device = request.path_param("device");
  const auto asked_more = field<bool>(*body, "more", false);
  const auto asked_height =
      field<double>(*body, "height_mm", device == "laser" ? cell.config.panel.thickness.count() : 0.0);
  const auto board_width = field<double>(*body, "board_width_mm", 0.0);
  const auto board_height = field<double>(*body, "board_height_mm", 0.0);
  auto confirmed = confirmed_in(*body);
  for (const Error* wrong : {error_of(asked_more), error_of(asked_height), error_of(board_width),
                             error_of(board_height), error_of(confirmed)})
    if (wrong != nullptr) return reply(ApiReply::error(*wrong));
  const bool more = *asked_more;
  const Millimetres height(*asked_height);
  if (device != "scanner" && device != "camera" && device != "laser" && device != "kerf")
    return reply(ApiReply::error(
        {ErrorCode::kNotFound,
         fmt::format("nothing to calibrate is called {}: use scanner, camera, laser or kerf", device)}));
  auto task = cell.tasks.start("calibrate " + device, "waiting for the device");
  reply(ApiReply::task(task.id()));
  if (device == "laser")
    return calibrate_laser(cell, task, {height, Millimetres(*board_width), Millimetres(*board_height)},
                           request.caller.who, std::move(*confirmed));
  Worker& worker = device == "camera" ? *cell.camera_worker : *cell.scanner_worker;
  worker.post([&cell, task, device, more, height] {
    const auto progress = [&](double f, const std::string& text) { task.progress(f, text); };
    finish_calibration(cell, task,
                       device == "scanner"  ? cell.calibrations->scanner(more, progress, task.stop_token())
                       : device == "camera" ? cell.calibrations->camera(more, height, progress)
                                            : cell.calibrations->kerf(progress, task.stop_token()));
  });
}

}  // namespace

void bind_stock_routes(Router& router, Cell& cell) {
  router.bind("scan", [&cell](const ApiRequest& request, const Reply& reply) { scan(cell, request, reply); });
  router.bind("calibrate", [&cell](const ApiRequest& request, const Reply& reply) { calibrate(cell, request, reply); });
  router.bind("listCertificates", [&cell](const ApiRequest&, const Reply& reply) {
    reply_from_database(
        cell,
        [](Repositories& r) -> Result<json> {
          auto list = r.certificates.list();
          if (!list) return list.error();
          json out = {{"certificates", json::array()}};
          const std::string now = utc_timestamp();
          for (const auto& c : *list) out["certificates"].push_back(to_json(c, now));
          return out;
        },
        reply);
  });
  router.bind("listPanels", [&cell](const ApiRequest&, const Reply& reply) {
    reply_from_database(
        cell,
        [&cell](Repositories& r) -> Result<json> {
          auto list = r.panels.list();
          if (!list) return list.error();
          json out = {{"panels", json::array()}};
          for (const auto& panel : *list) {
            auto figures = figures_of(r, cell.panel_library, panel);
            if (!figures) return figures.error();
            out["panels"].push_back(to_json(panel, *figures));
          }
          return out;
        },
        reply);
  });
  const auto about_panel = [&router, &cell](const char* operation, auto work) {
    router.bind(operation, [&cell, work](const ApiRequest& request, const Reply& reply) {
      reply_from_database(
          cell, [work, id = PanelId{request.path_param("id")}](Repositories& r) { return work(r, id); }, reply);
    });
  };
  about_panel("getPanel",
              [&cell](Repositories& r, const PanelId& id) { return panel_json(r, cell.panel_library, id); });
  about_panel("getPanelRegistration", [](Repositories& r, const PanelId& id) { return registration_json(r, id); });
  about_panel("getPanelLedger", [](Repositories& r, const PanelId& id) { return ledger_json(r, id); });
  router.bind("getPanelMap",
              [&cell](const ApiRequest& request, const Reply& reply) { reply_picture(cell, request, reply, false); });
  router.bind("getPanelStock",
              [&cell](const ApiRequest& request, const Reply& reply) { reply_picture(cell, request, reply, true); });
}

}  // namespace veneer::daemon
