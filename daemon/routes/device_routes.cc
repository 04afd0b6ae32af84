// Which laser, scanner and camera the cell has, what is plugged in, and choosing one of it for the next start.
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "base/files.h"
#include "daemon/api/request_reader.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/unit/confirmations.h"
#include "daemon/wiring.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// What whoever chooses a laser confirms by name: the first Reset will move what is at that port.
constexpr const char* kRealLaser = "a laser is at this port";

const char* set_by_word(SetBy set_by) {
  switch (set_by) {
    case SetBy::kFile:
      return "file";
    case SetBy::kPage:
      return "page";
    case SetBy::kNobody:
      return "nobody";
  }
  return "nobody";
}

json device_choices_json(const Config& config) {
  const LaserConfig& laser = config.laser;
  json out = {{"laser", {{"kind", laser.kind}, {"set_by", set_by_word(laser.set_by)}, {"port", laser.port}}},
              {"scanner",
               {{"kind", config.scanner.kind},
                {"set_by", set_by_word(config.scanner.set_by)},
                {"device", config.scanner.device},
                {"dpi", config.scanner.dpi}}},
              {"camera",
               {{"kind", config.camera.kind},
                {"set_by", set_by_word(config.camera.set_by)},
                {"device", config.camera.device}}}};
  if (laser.kind == "lihuiyu") {
    out["laser"]["board"] = laser.board;
    out["laser"]["travel_mm"] = {laser.travel_x.count(), laser.travel_y.count()};
  }
  return out;
}

// A choice waits for nobody's hands to be in the machine, and a restart for nothing to be lost by it.
Status machine_rests(const JobRunner& unit) {
  switch (const CellState state = unit.view().state) {
    case CellState::kStopped:
    case CellState::kIdle:
    case CellState::kComplete:
    case CellState::kAborted:
      return Ok();
    default:
      return Error{ErrorCode::kConflict,
                   fmt::format("the cell is {}, and its devices stay what they are: let it end, or Stop it, then try "
                               "again",
                               to_string(state))};
  }
}

Status may_restart(const DeviceServices& s) {
  if (const Status rests = machine_rests(s.unit); !rests) return rests;
  if (const auto running = s.tasks.running(); !running.empty())
    return Error{ErrorCode::kConflict, fmt::format("\"{}\" is under way and would be lost: wait until it is done, or "
                                                   "cancel it",
                                                   running.front()->kind)};
  if (!s.restart)
    return Error{ErrorCode::kConflict,
                 "nobody would start veneerd again, since it was started by hand: end it there, and start it again"};
  return Ok();
}

// On a thread that may wait for a disk.
json devices_now(const DeviceServices& s, const Status& restart) {
  json out = device_choices_json(s.config);
  out["file"] = s.config.file.string();
  out["restart_refused"] = restart ? "" : restart.error().message;
  out["next"] = nullptr;
  out["problem"] = "";
  if (s.config.file.empty()) return out;
  const auto next = load_config(s.config.file);
  if (!next)
    out["problem"] = next.error().message;
  else if (json then = device_choices_json(*next); then != device_choices_json(s.config))
    out["next"] = std::move(then);
  return out;
}

void tell_devices(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  s.pictures.ask(request, reply,
                 [s, restart = may_restart(s)](Repositories&) { return ApiReply::json(devices_now(s, restart)); });
}

void find_devices(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  s.pictures.ask(request, reply, [s](Repositories&) {
    json lasers = json::array(), pictures = json::array();
    for (const FoundLaser& one : find_lasers(s.roots))
      lasers.push_back({{"kind", one.kind}, {"port", one.port}, {"name", one.name}, {"lasting", one.lasting}});
    for (const FoundPicture& one : find_camera_pictures(s.config.store.data_dir))
      pictures.push_back({{"device", one.file}, {"age_s", one.age.count()}});
    return ApiReply::json({{"lasers", std::move(lasers)}, {"pictures", std::move(pictures)}});
  });
}

// ---- choosing -------------------------------------------------------------------------------------------------------

Error not_found_now(const std::string& what) {
  return {ErrorCode::kNotFound, fmt::format("there is no {} now: look at its plug, and let the cell look again", what)};
}

// What is asked for, of whichever device; what belongs to another one is refused, not overheard.
struct AskedDevice {
  std::string kind;
  std::optional<std::string> port, board, device;
  std::optional<double> travel_x, travel_y, dpi;
  std::vector<std::string> confirmed;
};

struct DeviceKinds {
  std::string_view device;
  std::vector<std::string_view> kinds;
};
const std::vector<DeviceKinds>& device_kinds() {
  static const std::vector<DeviceKinds> kAll = {
      {"laser", {"grbl", "lihuiyu", "sim"}}, {"scanner", {"sane", "sim"}}, {"camera", {"file", "sim"}}};
  return kAll;
}

AskedDevice read_asked(const DeviceKinds& of, RequestReader& body) {
  AskedDevice asked;
  asked.kind = body.word("kind", {"sim", "grbl", "lihuiyu", "sane", "file"}).value_or("");
  asked.port = body.text("port");
  asked.board = body.word("board", {"m2", "m3"});
  asked.travel_x = body.number("travel_x_mm", {50, 2000});
  asked.travel_y = body.number("travel_y_mm", {50, 2000});
  asked.device = body.text("device");
  asked.dpi = body.number("dpi", {75, 1200});
  asked.confirmed = body.texts("confirmed").value_or(std::vector<std::string>{});
  body.require("kind");
  const auto only = [&](bool given, std::string_view name, std::string_view kind) {
    if (given && asked.kind != kind)
      body.refuse({ErrorCode::kInvalidArgument, fmt::format("{} belongs to the kind {}: leave it out", name, kind)});
  };
  if (std::ranges::find(of.kinds, asked.kind) == of.kinds.end())
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("kind = {} is no {}: use {}", asked.kind, of.device, fmt::join(of.kinds, ", "))});
  only(asked.board.has_value(), "board", "lihuiyu");
  only(asked.travel_x || asked.travel_y, "the travel", "lihuiyu");
  only(asked.dpi.has_value(), "dpi", "sane");
  const bool by_port = asked.kind == "grbl" || asked.kind == "lihuiyu";
  if (asked.port.has_value() != by_port)
    body.refuse({ErrorCode::kInvalidArgument, by_port ? "port is missing: name it as GET /devices/found does"
                                                      : "port belongs to a laser that is not simulated: leave it out"});
  if (asked.device && asked.kind != "sane") only(true, "device", "file");
  if (asked.kind == "file" && !asked.device)
    body.refuse({ErrorCode::kInvalidArgument, "device is missing: name the picture as GET /devices/found does"});
  constexpr std::size_t kLongestName = 200;
  const std::string name = asked.device.value_or("");
  if (name.size() > kLongestName || !std::ranges::all_of(name, [](char c) { return c >= ' ' && c <= '~'; }))
    body.refuse(
        {ErrorCode::kInvalidArgument, "device is no name that a scanner or a picture has: take it from the list"});
  if (by_port)
    if (const Status seen = check_confirmed({kRealLaser}, asked.confirmed); !seen) body.refuse(seen.error());
  return asked;
}

Status choose_laser(const DeviceRoots& roots, const AskedDevice& asked, Config& config) {
  LaserConfig laser;
  laser.set_by = SetBy::kPage;
  laser.kind = asked.kind;
  laser.port = asked.port.value_or("");
  laser.board = asked.board.value_or(laser.board);
  laser.travel_x = Millimetres(asked.travel_x.value_or(laser.travel_x.count()));
  laser.travel_y = Millimetres(asked.travel_y.value_or(laser.travel_y.count()));
  laser.focus_z = config.laser.focus_z;
  if (laser.kind != "sim") {
    const auto is_it = [&](const FoundLaser& one) { return one.kind == laser.kind && one.port == laser.port; };
    if (std::ranges::none_of(find_lasers(roots), is_it))
      return not_found_now(fmt::format("laser of the kind {} at \"{}\"", laser.kind, laser.port));
    if (const Status made = laser_can_be_made(laser); !made) return made;
  }
  config.laser = laser;
  return Ok();
}

Status choose_scanner(const AskedDevice& asked, Config& config) {
  config.scanner.set_by = SetBy::kPage;
  config.scanner.kind = asked.kind;
  config.scanner.device = asked.device.value_or("");
  config.scanner.dpi = asked.dpi.value_or(ScannerConfig().dpi);
  return Ok();
}

Status choose_camera(const AskedDevice& asked, Config& config) {
  const std::string device = asked.device.value_or("");
  if (asked.kind == "file" && std::ranges::none_of(find_camera_pictures(config.store.data_dir),
                                                   [&](const FoundPicture& one) { return one.file == device; }))
    return not_found_now(fmt::format("picture \"{}\" in the data folder", device));
  config.camera.set_by = SetBy::kPage;
  config.camera.kind = asked.kind;
  config.camera.device = device;
  return Ok();
}

SetBy set_by_of(const Config& config, const std::string& device) {
  if (device == "laser") return config.laser.set_by;
  return device == "scanner" ? config.scanner.set_by : config.camera.set_by;
}

// What is kept is what the next start will read: the whole configuration is tried with it first, as the file is now.
Status keep_choice(const DeviceServices& s, const std::string& device, const AskedDevice& asked) {
  const auto now = load_config(s.config.file);
  if (!now) return now.error();
  if (set_by_of(*now, device) == SetBy::kFile)
    return Error{ErrorCode::kConflict,
                 fmt::format("the {0} is set by hand, and that stays: take kind, and what belongs to it, out of [{0}] "
                             "in {1} to choose it here",
                             device, s.config.file.string())};
  Config wanted = *now;
  const Status chosen = device == "laser"     ? choose_laser(s.roots, asked, wanted)
                        : device == "scanner" ? choose_scanner(asked, wanted)
                                              : choose_camera(asked, wanted);
  if (!chosen) return chosen;
  const std::string text = chosen_devices_text(wanted);
  if (const auto tried = load_config(s.config.file, text); !tried) return tried.error();
  return write_whole(now->store.data_dir / kChosenDevicesName, std::as_bytes(std::span(text)));
}

void choose_device(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  const std::string device = request.path_param("device");
  const auto& all = device_kinds();
  const auto of = std::ranges::find_if(all, [&](const DeviceKinds& one) { return one.device == device; });
  if (of == all.end())
    return reply(ApiReply::error(
        {ErrorCode::kNotFound, fmt::format("no device \"{}\": there are laser, scanner and camera", device)}));
  auto body = RequestReader::body_of(request);
  const AskedDevice asked = read_asked(*of, body);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (const Status rests = machine_rests(s.unit); !rests) return reply(ApiReply::error(rests.error()));
  if (s.config.file.empty())
    return reply(ApiReply::error({ErrorCode::kConflict, "this cell has no configuration file to choose beside"}));
  s.pictures.ask(request, reply, [s, device, asked, restart = may_restart(s)](Repositories&) {
    const Status kept = keep_choice(s, device, asked);
    return kept ? ApiReply::json(devices_now(s, restart)) : ApiReply::error(kept.error());
  });
}

// Only into a configuration that is good: whoever ends now must come back.
void restart(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  if (const Status may = may_restart(s); !may) return reply(ApiReply::error(may.error()));
  const auto then = [s, reply](const ApiReply& checked) {
    s.on_reactor([s, reply, checked] {
      const bool good = checked.status == 200;
      // Time has passed since it was asked.
      if (const Status may = may_restart(s); good && !may) return reply(ApiReply::error(may.error()));
      reply(checked);
      if (good) s.restart();
    });
  };
  s.pictures.ask(request, then, [s](Repositories&) {
    const auto next = s.config.file.empty() ? Result<Config>(s.config) : load_config(s.config.file);
    return next ? ApiReply::json({{"restarting", true}}) : ApiReply::error(next.error());
  });
}

}  // namespace

void bind_device_routes(Router& router, const DeviceServices& s) {
  router.bind("getDevices", [s](const ApiRequest& request, const Reply& reply) { tell_devices(s, request, reply); });
  router.bind("findDevices", [s](const ApiRequest& request, const Reply& reply) { find_devices(s, request, reply); });
  router.bind("chooseDevice", [s](const ApiRequest& request, const Reply& reply) { choose_device(s, request, reply); });
  router.bind("restart", [s](const ApiRequest& request, const Reply& reply) { restart(s, request, reply); });
}

}  // namespace veneer::daemon
