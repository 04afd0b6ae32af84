// Which laser, scanner and camera the cell has, what is plugged in, and choosing one of it for the next start.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "base/files.h"
#include "daemon/api/request_reader.h"
#include "daemon/api/tls.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/wiring.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// What whoever chooses confirms by name: the first Reset will move what is at that port; nothing real is done any more.
constexpr const char *kRealLaser = "a laser is at this port", *kSimulation = "a simulation takes its place";

json device_choices_json(const Config& config) {
  const LaserConfig& laser = config.laser;
  json out = {
      {"laser", {{"kind", laser.kind}, {"set_by", to_string(laser.set_by)}, {"port", laser.port}}},
      {"scanner",
       {{"kind", config.scanner.kind},
        {"set_by", to_string(config.scanner.set_by)},
        {"device", config.scanner.device},
        {"dpi", config.scanner.dpi}}},
      {"camera",
       {{"kind", config.camera.kind}, {"set_by", to_string(config.camera.set_by)}, {"device", config.camera.device}}}};
  if (laser.kind == "lihuiyu") {
    out["laser"]["board"] = laser.board;
    out["laser"]["travel_mm"] = {laser.travel_x.count(), laser.travel_y.count()};
  }
  if (const CameraConfig& camera = config.camera; camera.kind == "v4l2")
    out["camera"].update({{"width", camera.width},
                          {"height", camera.height},
                          {"format", camera.format},
                          {"settings", settings_json(camera.options)}});
  return out;
}

Status may_restart(const DeviceServices& s) {
  if (Status rests = s.unit.at_rest(); !rests) return rests;
  if (s.integrity.state() == DatabaseCheck::State::kChecking)
    return Error{ErrorCode::kConflict, "the database is being checked: wait until that is done"};
  if (const auto running = s.tasks.running(); !running.empty())
    return Error{ErrorCode::kConflict, fmt::format("\"{}\" is under way and would be lost: wait until it is done, or "
                                                   "cancel it",
                                                   running.front()->kind)};
  if (!s.restart)
    return Error{
        ErrorCode::kConflict,
        "veneerd was started by hand, or by a program that it does not know (not by systemd itself), and perhaps "
        "nobody would start it again: end it there, and start it again"};
  return Ok();
}

// The configuration of the next start, if that can be told to succeed without being tried: it is good, and so are the
// names and files that it gives. On a thread that may wait for a disk.
Result<Config> next_start(const DeviceServices& s) {
  auto next = s.config.file.empty() ? Result<Config>(s.config) : load_config(s.config.file);
  if (!next) return next;
  if (const Status made = laser_can_be_made(next->laser); !made) return made.error();
  if (const Status one = means_one_machine(s.roots, next->laser); !one) return one.error();
  if (next->api.listen_tls.empty()) return next;
  if (const auto identity = TlsIdentity::load(next->api.tls_certificate, next->api.tls_key); !identity)
    return identity.error();
  return next;
}

// On a thread that may wait for a disk.
json devices_now(const DeviceServices& s, const Status& restart) {
  json out = device_choices_json(s.config);
  out["file"] = s.config.file.string();
  out["choose"] = s.config.devices.choose;
  out["camera_folder"] = s.config.devices.choose ? json(camera_folder(s.config.store.data_dir).string()) : json();
  out["restart_refused"] = restart ? "" : restart.error().message;
  out["next"] = nullptr;
  out["problem"] = "";
  if (s.config.file.empty()) return out;
  if (const auto next = next_start(s); !next) out["problem"] = next.error().message;
  // What is chosen is told where it cannot be started with, too.
  if (const auto written = load_config(s.config.file))
    if (json then = device_choices_json(*written); then != device_choices_json(s.config)) out["next"] = std::move(then);
  return out;
}

// For whoever only looks on: what each device is, and neither where it is plugged in nor what lies where on the disk. A
// sentence about the configuration may hold a line of it, and there may be keys to other houses in those.
void leave_out_places(json& told) {
  for (json* devices : {&told, &told["next"]}) {
    if (devices->is_null()) continue;
    (*devices)["laser"]["port"] = (*devices)["scanner"]["device"] = (*devices)["camera"]["device"] = "";
  }
  told["file"] = "", told["camera_folder"] = nullptr;
  if (!told["problem"].get_ref<const std::string&>().empty())
    told["problem"] = "the cell would not start again as things are; an operator is told why";
}

void tell_devices(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  const bool all = request.caller.role >= Role::kOperator;
  s.pictures.ask(request, reply, [s, all, restart = may_restart(s)](Repositories&) {
    json out = devices_now(s, restart);
    if (!all) leave_out_places(out);
    return ApiReply::json(out);
  });
}

void find_devices(const DeviceServices& s, const ApiRequest& request, const Reply& reply) {
  s.pictures.ask(request, reply, [s](Repositories&) {
    json lasers = json::array(), pictures = json::array();
    for (const FoundLaser& one : find_lasers(s.roots))
      lasers.push_back({{"kind", one.kind},
                        {"port", one.port},
                        {"name", one.name},
                        {"named_by", to_json(one.named_by)},
                        {"refusal", one.refusal}});
    for (const FoundPicture& one : find_camera_pictures(s.config.store.data_dir))
      pictures.push_back({{"device", one.file}, {"age_s", one.age.count()}});
    return ApiReply::json({{"lasers", std::move(lasers)}, {"pictures", std::move(pictures)}});
  });
}

// ---- choosing -------------------------------------------------------------------------------------------------------

// What is asked for, of one device; the others of `wanted` are not.
struct AskedDevice {
  std::string device;
  ChosenDevices wanted;
  std::optional<std::int64_t> trial;  // whose picture was looked at; of a camera of this computer always
  std::vector<std::string> confirmed;
};

struct DeviceKinds {
  std::string_view device;
  std::vector<std::string_view> kinds;
};
const std::vector<DeviceKinds>& device_kinds() {
  static const std::vector<DeviceKinds> kAll = {
      {"laser", {"grbl", "lihuiyu", "sim"}}, {"scanner", {"sane", "sim"}}, {"camera", {"v4l2", "file", "sim"}}};
  return kAll;
}

// Whatever belongs to a kind must be there, and to another must not: it is refused, not overheard. A Lihuiyu board
// knows neither what it is nor its travel, and a guess would drive the head against its frame.
AskedDevice read_asked(const DeviceKinds& of, RequestReader& body) {
  const std::string kind = body.word("kind", {"sim", "grbl", "lihuiyu", "sane", "v4l2", "file"}).value_or("sim");
  const auto port = body.text("port"), device = body.text("device");
  const auto board = body.word("board", {"m2", "m3"});
  const auto travel_x = body.number("travel_x_mm", {50, 2000}), travel_y = body.number("travel_y_mm", {50, 2000});
  const auto dpi = body.number("dpi", {75, 1200});
  AskedDevice asked;
  asked.device = of.device;
  asked.trial = body.whole("trial", {1, 1e15});
  asked.confirmed = body.texts("confirmed").value_or(std::vector<std::string>{});
  body.require("kind");
  const auto refuse = [&](std::string sentence) { body.refuse({ErrorCode::kInvalidArgument, std::move(sentence)}); };
  if (std::ranges::find(of.kinds, kind) == of.kinds.end())
    refuse(fmt::format("kind = {} is no {}: use {}", kind, of.device, fmt::join(of.kinds, ", ")));
  const bool is_board = kind == "lihuiyu", has_port = is_board || kind == "grbl";
  const auto belongs = [&](std::string_view name, bool given, bool wanted) {
    if (given && !wanted) refuse(fmt::format("{} does not belong to the kind {}: leave it out", name, kind));
    if (!given && wanted) refuse(fmt::format("{} is missing: the kind {} needs it", name, kind));
  };
  belongs("port", port.has_value(), has_port);
  belongs("board", board.has_value(), is_board);
  belongs("travel_x_mm", travel_x.has_value(), is_board);
  belongs("travel_y_mm", travel_y.has_value(), is_board);
  belongs("device", device.has_value(), kind == "sane" || kind == "v4l2" || kind == "file");
  if (kind != "sane") belongs("dpi", dpi.has_value(), false);
  if (kind != "v4l2") belongs("trial", asked.trial.has_value(), false);
  if (kind == "v4l2" && !asked.trial)
    refuse(
        "trial is missing: take a picture with the camera (veneerctl camera try DEVICE), look at it, and give its "
        "number (veneerctl: --trial)");
  ChosenDevices& wanted = asked.wanted;
  if (of.device == "laser")
    wanted.laser = {kind, port.value_or(""), board.value_or("m2"), Millimetres(travel_x.value_or(300)),
                    Millimetres(travel_y.value_or(200))};
  if (of.device == "scanner") wanted.scanner = {kind, device.value_or(""), dpi};
  if (of.device == "camera") wanted.camera.kind = kind, wanted.camera.device = device.value_or("");
  return asked;
}

// Only what was found by this cell can be chosen, by a name that lasts: no path, no file, no address on the network
// that somebody types.
Status check_laser(const DeviceRoots& roots, const ChosenDevices::Laser& wanted) {
  if (wanted.kind == "sim") return Ok();
  const auto found = find_lasers(roots);
  const auto it = std::ranges::find_if(
      found, [&](const FoundLaser& one) { return one.kind == wanted.kind && one.port == wanted.port; });
  if (it == found.end())
    return Error{ErrorCode::kNotFound, fmt::format("there is no {} laser of that name now: look at its plug, and let "
                                                   "the cell look again",
                                                   wanted.kind)};
  if (!it->refusal.empty()) return Error{ErrorCode::kRefused, it->refusal};
  LaserConfig laser;
  laser.kind = wanted.kind;
  laser.port = wanted.port;
  return laser_can_be_made(laser);
}

// SANE's own names change with the port, and one with a colon would be opened though nobody found it: a scanner is
// named by its make, which only one of those that were found may have.
Status check_scanner(const std::shared_ptr<const TaskResult>& found, const ChosenDevices::Scanner& wanted) {
  if (wanted.kind == "sim") return Ok();
  const json told = found ? json::parse(found->json, nullptr, false) : json();
  std::size_t there = 0;
  if (told.is_object() && told.contains("scanners"))
    for (const json& one : told["scanners"]) there += one.value("make", "") == wanted.device ? 1 : 0;
  if (there == 0 || wanted.device.empty())
    return Error{ErrorCode::kNotFound,
                 "no scanner of that make was found when this cell looked last: look for "
                 "scanners again, and take its make from the list"};
  if (there > 1)
    return Error{ErrorCode::kRefused,
                 "several scanners of that make were found, and nothing tells them apart: leave one of them in"};
  constexpr std::size_t kLongestName = 200;
  const auto plain = [](char c) { return c >= ' ' && c <= '~' && c != ':'; };
  if (wanted.device.size() > kLongestName || !std::ranges::all_of(wanted.device, plain))
    return Error{ErrorCode::kRefused,
                 "the make of that scanner cannot be kept as a name: write the scanner into veneerd.toml"};
  return Ok();
}

// What is chosen is what somebody could see: the camera as it was tried last, with all that was set then.
Result<ChosenDevices::Camera> tried_camera(const DeviceServices& s, const AskedDevice& asked) {
  const ChosenDevices::Camera& wanted = asked.wanted.camera;
  if (wanted.kind != "v4l2") return wanted;
  if (const Status there = is_plugged_in(s.roots, wanted.device); !there) return there.error();
  if (const Status one = may_be_tried(s.roots, wanted.device); !one) return one.error();
  const auto last = s.trials.last();
  if (!last || last->camera.device != wanted.device)
    return Error{
        ErrorCode::kNotFound,
        fmt::format("no picture was taken with that camera last: take one with veneerctl camera try \"{}\", and "
                    "choose it when you have seen it",
                    wanted.device)};
  if (asked.trial != last->task)
    return Error{ErrorCode::kConflict,
                 "somebody has taken another picture with that camera since, perhaps with other settings: take one "
                 "again, and look at it"};
  const CameraConfig& tried = last->camera;
  return ChosenDevices::Camera{"v4l2", tried.device, tried.width, tried.height, tried.format, tried.options};
}

Status check_camera(const std::filesystem::path& data_dir, const ChosenDevices::Camera& wanted) {
  if (wanted.kind != "file") return Ok();
  const auto is_it = [&](const FoundPicture& one) { return one.file == wanted.device; };
  if (std::ranges::none_of(find_camera_pictures(data_dir), is_it))
    return Error{ErrorCode::kNotFound, fmt::format("there is no such picture in {} now: let the camera's program write "
                                                   "it there, and let the cell look again",
                                                   camera_folder(data_dir).string())};
  return Ok();
}

// A device of a configuration, for sentences.
struct OneDevice {
  SetBy set_by;
  std::string kind, address;
  std::string more = "";  // what else is said of it
  std::string words() const { return kind == "sim" ? "simulated" : kind + " " + address + more; }
};
OneDevice device_of(const Config& config, const std::string& device) {
  const LaserConfig& laser = config.laser;
  if (device == "laser")
    return {laser.set_by, laser.kind, laser.port,
            laser.kind == "lihuiyu"
                ? fmt::format(", {}, {:g} x {:g} mm", laser.board, laser.travel_x.count(), laser.travel_y.count())
                : ""};
  if (device == "scanner")
    return {config.scanner.set_by, config.scanner.kind, config.scanner.device,
            fmt::format(", {:g} dpi", config.scanner.dpi)};
  OneDevice camera{config.camera.set_by, config.camera.kind, config.camera.device};
  if (camera.kind == "v4l2")
    camera.more = fmt::format(", {} x {} {}", config.camera.width, config.camera.height, config.camera.format);
  for (const auto& [name, value] : config.camera.options) camera.more += fmt::format(", {} {}", name, value);
  return camera;
}

Status may_choose(const Config& now, const std::string& device) {
  if (!now.devices.choose)
    return Error{ErrorCode::kConflict,
                 fmt::format("{} does not let devices be chosen: write choose = true under [devices] there, then "
                             "restart",
                             now.file.string())};
  if (device_of(now, device).set_by == SetBy::kFile)
    return Error{ErrorCode::kConflict,
                 fmt::format("the {0} is set by hand, and that stays: write kind = \"sim\", and nothing else of a {0}, "
                             "under [{0}] in {1} to choose it here",
                             device, now.file.string())};
  return Ok();
}

Status check_sure(const AskedDevice& asked, const char* of_what, std::string_view meaning) {
  if (std::ranges::find(asked.confirmed, of_what) != asked.confirmed.end()) return Ok();
  return Error{ErrorCode::kRefused, fmt::format("{}: if that is meant, confirm \"{}\", with veneerctl by --confirm "
                                                "\"{}\"",
                                                meaning, of_what, of_what)};
}

Status check_choice(const DeviceServices& s, const AskedDevice& asked, const Config& now,
                    const std::shared_ptr<const TaskResult>& scanners) {
  Status there = asked.device == "laser"     ? check_laser(s.roots, asked.wanted.laser)
                 : asked.device == "scanner" ? check_scanner(scanners, asked.wanted.scanner)
                                             : check_camera(now.store.data_dir, asked.wanted.camera);
  if (!there) return there;
  if (asked.device == "laser" && asked.wanted.laser.kind != "sim")
    return check_sure(
        asked, kRealLaser,
        "the first Reset from then on moves whatever is at this port, so its emergency stop must have been "
        "tried and work without the computer");
  const std::string kind = asked.device == "laser"     ? asked.wanted.laser.kind
                           : asked.device == "scanner" ? asked.wanted.scanner.kind
                                                       : asked.wanted.camera.kind;
  const bool was_real = device_of(now, asked.device).kind != "sim" || device_of(s.config, asked.device).kind != "sim";
  if (kind != "sim" || !was_real) return Ok();
  return check_sure(
      asked, kSimulation,
      asked.device == "laser"
          ? "from then on a program plays the laser: nothing is burnt, and what it seems to cut is booked "
            "as cut"
          : "from then on a program plays this device, and what it shows is none of your wood");
}

// What is kept is what the next start will read: the whole configuration is tried with it first, as the file is now.
// The audit log says so before it is. One at a time, or two would read the same file and one of them be lost.
Status keep_choice(const DeviceServices& s, const AskedDevice& asked, const std::string& who,
                   const std::shared_ptr<const TaskResult>& scanners) {
  const auto now = load_config(s.config.file);
  if (!now) return now.error();
  if (const Status may = may_choose(*now, asked.device); !may) return may.error();
  if (const Status good = check_choice(s, asked, *now, scanners); !good) return good.error();
  ChosenDevices wanted = now->devices.chosen.value_or(ChosenDevices{});
  if (asked.device == "laser") wanted.laser = asked.wanted.laser;
  if (asked.device == "scanner") wanted.scanner = asked.wanted.scanner;
  if (asked.device == "camera") {
    auto camera = tried_camera(s, asked);
    if (!camera) return camera.error();
    wanted.camera = *std::move(camera);
  }
  const std::string text = chosen_devices_text(wanted);
  const auto tried = load_config(s.config.file, text);
  if (!tried) return tried.error();
  const std::string done = fmt::format("{} from the next start: {}; before: {}", asked.device,
                                       device_of(*tried, asked.device).words(), device_of(*now, asked.device).words());
  if (const Status told = s.audit(who, db::kDeviceChosen, done); !told) return told.error();
  Status kept = write_whole(now->store.data_dir / kChosenDevicesName, std::as_bytes(std::span(text)));
  if (!kept)
    if (const Status told = s.audit(who, db::kDeviceNotChosen, kept.error().message); !told) return told.error();
  return kept;
}

// What the cell found last, when it was asked for scanners.
std::shared_ptr<const TaskResult> scanners_found(const TaskRegistry& tasks) {
  const auto all = tasks.list();
  for (auto task = all.rbegin(); task != all.rend(); ++task)
    if ((*task)->kind == "find scanners" && (*task)->state == TaskState::kDone)
      return (*task)->shortened ? nullptr : (*task)->result;
  return nullptr;
}

void choose_device(const DeviceServices& s, const std::shared_ptr<std::mutex>& one_at_a_time, const ApiRequest& request,
                   const Reply& reply) {
  const std::string device = request.path_param("device");
  const auto of = std::ranges::find(device_kinds(), device, &DeviceKinds::device);
  if (of == device_kinds().end())
    return reply(
        ApiReply::error({ErrorCode::kNotFound, "there is no such device: there are laser, scanner and camera"}));
  auto body = RequestReader::body_of(request);
  const AskedDevice asked = read_asked(*of, body);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (const Status rests = s.unit.at_rest(); !rests) return reply(ApiReply::error(rests.error()));
  if (s.config.file.empty())
    return reply(ApiReply::error(
        {ErrorCode::kConflict, "this cell has no configuration file to choose beside: start veneerd with --config"}));
  s.pictures.ask(request, reply,
                 [s, asked, one_at_a_time, who = request.caller.who, scanners = scanners_found(s.tasks),
                  restart = may_restart(s)](Repositories&) {
                   const std::lock_guard lock(*one_at_a_time);
                   const Status kept = keep_choice(s, asked, who, scanners);
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
    const auto next = next_start(s);
    return next ? ApiReply::json({{"restarting", true}}) : ApiReply::error(next.error());
  });
}

}  // namespace

json to_json(NamedBy named_by) {
  switch (named_by) {
    case NamedBy::kSerialNumber:
      return "serial_number";
    case NamedBy::kSocket:
      return "socket";
    case NamedBy::kNothing:
      return nullptr;
  }
  return nullptr;
}

void bind_device_routes(Router& router, const DeviceServices& s) {
  router.bind("getDevices", [s](const ApiRequest& request, const Reply& reply) { tell_devices(s, request, reply); });
  router.bind("findDevices", [s](const ApiRequest& request, const Reply& reply) { find_devices(s, request, reply); });
  router.bind("chooseDevice",
              [s, one_at_a_time = std::make_shared<std::mutex>()](const ApiRequest& request, const Reply& reply) {
                choose_device(s, one_at_a_time, request, reply);
              });
  router.bind("restart", [s](const ApiRequest& request, const Reply& reply) { restart(s, request, reply); });
}

}  // namespace veneer::daemon
