#include "drivers/sim/twin_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/sim/placing.h"
#include "drivers/sim/random.h"
#include "drivers/sim/scanner.h"
#include "drivers/sim/truth_files.h"

namespace veneer::sim {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

enum class Type { kText, kNumber, kFlag, kAny };

struct Argument {
  std::string_view name;
  Type type = Type::kText;
  bool required = true;
};

bool has_type(const json& value, Type type) {
  switch (type) {
    case Type::kText:
      return value.is_string();
    case Type::kNumber:
      return value.is_number();
    case Type::kFlag:
      return value.is_boolean();
    case Type::kAny:
      return true;
  }
  return false;
}

const char* describe(Type type) {
  switch (type) {
    case Type::kText:
      return "a text";
    case Type::kNumber:
      return "a number";
    case Type::kFlag:
      return "true or false";
    case Type::kAny:
      return "a value";
  }
  return "a value";
}

Error invalid(std::string sentence) { return {ErrorCode::kInvalidArgument, std::move(sentence)}; }

Result<SheetFace> face_named(const std::string& name) {
  if (name == "show") return SheetFace::kShow;
  if (name == "back") return SheetFace::kBack;
  return invalid(fmt::format("a sheet has no face \"{}\": use show or back", name));
}

Result<Spot> spot_named(const std::string& name) {
  if (name == "scanner") return Spot::kScanner;
  if (name == "bed") return Spot::kBed;
  return invalid(fmt::format("there is no place \"{}\": use scanner or bed", name));
}

const char* to_string(Spot spot) {
  switch (spot) {
    case Spot::kShelf:
      return "shelf";
    case Spot::kScanner:
      return "scanner";
    case Spot::kBed:
      return "bed";
  }
  return "shelf";
}

Result<json> done(const Status& status) {
  if (!status.ok()) return status.error();
  return json::object();
}

}  // namespace

struct TwinService::Command {
  std::string_view name;
  bool quick;
  Handler handler;
  std::vector<Argument> arguments;
};

const TwinService::Command* TwinService::find(const json& request) {
  static const std::vector<Command> kCommands = {
      {"status", true, &TwinService::status, {}},
      {"lid", true, &TwinService::lid, {{"open", Type::kFlag}}},
      {"fault", true, &TwinService::fault, {{"name"}, {"value", Type::kAny, false}, {"after", Type::kNumber, false}}},
      {"power", true, &TwinService::power, {{"laser", Type::kFlag}}},
      {"consent", true, &TwinService::consent, {{"given", Type::kFlag}}},
      {"signal-at-burn",
       true,
       &TwinService::signal_at_burn,
       {{"pid", Type::kNumber}, {"signal", Type::kNumber}, {"burnt_mm", Type::kNumber}}},
      {"fill-disk-at-burn",
       true,
       &TwinService::fill_disk_at_burn,
       {{"pid", Type::kNumber}, {"burnt_mm", Type::kNumber}}},
      {"send-at-burn", true, &TwinService::send_at_burn, {{"socket"}, {"text"}, {"burnt_mm", Type::kNumber}}},
      {"burn-log", true, &TwinService::burn_log, {}},
      {"new-panel",
       false,
       &TwinService::new_panel,
       {{"name"}, {"width_mm", Type::kNumber}, {"height_mm", Type::kNumber}, {"strips", Type::kNumber, false}}},
      {"new-grid", false, &TwinService::new_grid, {{"name"}}},
      {"new-board",
       false,
       &TwinService::new_board,
       {{"name"}, {"width_mm", Type::kNumber}, {"height_mm", Type::kNumber}}},
      {"place",
       false,
       &TwinService::place,
       {{"sheet"},
        {"on"},
        {"face"},
        {"part", Type::kText, false},
        {"height_mm", Type::kNumber, false},
        {"x_mm", Type::kNumber, false},
        {"y_mm", Type::kNumber, false},
        {"turn_deg", Type::kNumber, false}}},
      {"lift", false, &TwinService::lift, {{"from"}, {"leave_bridges", Type::kFlag, false}}},
      {"nudge", false, &TwinService::nudge, {}},
      {"measure", false, &TwinService::measure, {{"sheet"}}},
      {"scan", false, &TwinService::scan, {{"dpi", Type::kNumber, false}}},
      {"camera", false, &TwinService::camera, {{"glance", Type::kFlag, false}}}};
  const auto name = request.find("cmd");
  if (name == request.end() || !name->is_string()) return nullptr;
  const auto at = std::find_if(kCommands.begin(), kCommands.end(),
                               [&](const Command& c) { return c.name == name->get_ref<const std::string&>(); });
  return at == kCommands.end() ? nullptr : &*at;
}

TwinService::TwinService(World& world, LaserBench& laser, Logger log)
    : world_(world), laser_(laser), log_(std::move(log)) {}

bool TwinService::is_quick(const json& request) {
  const Command* command = request.is_object() ? find(request) : nullptr;
  return command == nullptr || command->quick;
}

json TwinService::refusal(const Error& error) {
  return {{"ok", false}, {"code", to_string(error.code)}, {"error", error.message}};
}

json TwinService::handle(const json& request) {
  if (!request.is_object()) return refusal(invalid("the twin expects one JSON object per line"));
  const Command* command = find(request);
  if (command == nullptr) {
    const auto name = request.find("cmd");
    return refusal(invalid(name == request.end() ? "a request to the twin needs a \"cmd\""
                                                 : fmt::format("the twin knows no command {}", name->dump())));
  }
  for (const Argument& a : command->arguments) {
    const auto value = request.find(a.name);
    if (value == request.end()) {
      if (a.required) return refusal(invalid(fmt::format("{} needs \"{}\"", command->name, a.name)));
    } else if (!has_type(*value, a.type)) {
      return refusal(invalid(fmt::format("\"{}\" of {} must be {}", a.name, command->name, describe(a.type))));
    }
  }
  for (const auto& [key, value] : request.items()) {
    const bool known = key == "cmd" || std::any_of(command->arguments.begin(), command->arguments.end(),
                                                   [&k = key](const Argument& a) { return a.name == k; });
    if (!known) return refusal(invalid(fmt::format("{} takes no \"{}\"", command->name, key)));
  }
  try {
    Reply reply = (this->*command->handler)(request);
    if (!reply.ok()) return refusal(reply.error());
    (*reply)["ok"] = true;
    return *reply;
  } catch (const std::exception& e) {
    // OpenCV out of memory, mostly.
    log_->error("{} failed: {}", command->name, e.what());
    return refusal({ErrorCode::kInternal, fmt::format("{} failed: {}", command->name, e.what())});
  }
}

TwinService::Reply TwinService::status(const json&) {
  json sheets = json::array(), faults = json::array();
  for (const SheetSummary& s : world_.sheets()) {
    json one = {{"name", s.name}, {"kind", to_string(s.kind)}, {"where", to_string(s.where)}};
    // On the scanner the upper face is the one the glass does not see.
    const SheetFace seen = s.face, hidden = seen == SheetFace::kShow ? SheetFace::kBack : SheetFace::kShow;
    if (s.where != Spot::kShelf) one["face_up"] = to_string(s.where == Spot::kBed ? seen : hidden);
    sheets.push_back(one);
  }
  if (scanner_dead_) faults.push_back("scanner_dead");
  if (camera_dead_) faults.push_back("camera_dead");
  if (camera_dark_) faults.push_back("camera_dark");
  if (drifted_ != 0) faults.push_back("axis_drift");
  json laser = laser_.describe();
  const json lid = laser.value("lid", json("closed"));
  return json{{"sheets", sheets}, {"lid", lid}, {"faults", faults}, {"laser", laser}};
}

TwinService::Reply TwinService::new_panel(const json& r) {
  const double strips = r.value("strips", 0.0);
  if (!(strips >= 0 && strips <= 100)) return invalid("\"strips\" of new-panel must be from 0 to 100");
  return done(world_.new_panel(r.at("name"), r.at("width_mm"), r.at("height_mm"), static_cast<int>(strips)));
}

TwinService::Reply TwinService::new_grid(const json& r) { return done(world_.new_grid(r.at("name"))); }

TwinService::Reply TwinService::new_board(const json& r) {
  return done(world_.new_board(r.at("name"), r.at("width_mm"), r.at("height_mm")));
}

// What every cell has lying about need not be made first: it is made when it is first taken up.
Status TwinService::make_if_usual(const std::string& name) {
  if (world_.sheet(name).ok()) return Ok();
  const auto& bed = world_.truth().settings.bed;
  if (name == "grid") return world_.new_grid(name);
  if (name == "board")
    return world_.new_board(name, std::min(490.0, bed.width_mm - 30), std::min(290.0, bed.height_mm - 30));
  if (name == "panel") return world_.new_panel(name, 240, 160, 6);
  return Ok();  // the world says that there is no such sheet
}

TwinService::Reply TwinService::place(const json& r) {
  const Result<Spot> on = spot_named(r.at("on"));
  if (!on.ok()) return on.error();
  const Result<SheetFace> face = face_named(r.at("face"));
  if (!face.ok()) return face.error();
  if (const Status made = make_if_usual(r.at("sheet")); !made.ok()) return made.error();
  if (r.contains("x_mm") || r.contains("y_mm") || r.contains("turn_deg")) {
    if (*on != Spot::kBed) return invalid("only on the bed is a sheet laid where somebody says: leave x_mm, y_mm out");
    const auto sheet = world_.sheet(r.at("sheet"));
    if (!sheet.ok()) return sheet.error();
    const Vec2 middle{r.value("x_mm", world_.truth().settings.bed.width_mm / 2),
                      r.value("y_mm", world_.truth().settings.bed.height_mm / 2)};
    Random random(world_.truth().settings.seed, "told", static_cast<std::uint64_t>(world_.next_picture("placement")));
    const SheetPose pose = lay_as_told(**sheet, *face, middle, r.value("turn_deg", 0.0), random);
    return done(world_.place_at({r.at("sheet"), *face, pose, r.value("height_mm", 0.0)}, *on));
  }
  return done(
      world_.place(r.at("sheet"), *on, *face, r.value("part", std::string("whole")), r.value("height_mm", 0.0)));
}

TwinService::Reply TwinService::lift(const json& r) {
  const Result<Spot> from = spot_named(r.at("from"));
  return from.ok() ? done(world_.lift(*from, r.value("leave_bridges", false))) : Reply(from.error());
}

TwinService::Reply TwinService::nudge(const json&) { return done(world_.nudge()); }

// A caliper, which is off by up to 0.02 mm and shows hundredths: what it says is off by up to 0.025.
TwinService::Reply TwinService::measure(const json& r) {
  constexpr double kCaliper = 0.02;
  if (const Status made = make_if_usual(r.at("sheet")); !made.ok()) return made.error();
  const auto sheet = world_.sheet(r.at("sheet"));
  if (!sheet.ok()) return sheet.error();
  Random hand(world_.truth().settings.seed, "caliper", static_cast<std::uint64_t>(world_.next_picture("caliper")));
  const double reading = (*sheet)->thickness_mm + hand.spread(kCaliper);
  return json{{"thickness_mm", std::round(reading * 100) / 100}};
}

TwinService::Reply TwinService::scan(const json& r) {
  const double dpi = r.value("dpi", 300.0);
  if (!(dpi >= 75 && dpi <= 600)) return invalid(fmt::format("the scanner cannot scan at {} dpi: use 75 to 600", dpi));
  if (scanner_dead_) return Error{ErrorCode::kUnavailable, "the scanner does not answer: check its cable and mains"};
  const int number = world_.next_picture("capture");
  const std::optional<PlacedSheet> lies = world_.snapshot(Spot::kScanner);
  ScanTruth truth;
  truth.capture = fmt::format("capture-{}", number);
  truth.px_per_mm = dpi / 25.4;
  truth.scanner = scanner_of_today(world_.truth(), static_cast<std::uint64_t>(number));
  if (lies)
    truth.sheet = lies->sheet->name, truth.face = lies->placement.face, truth.glass_from_sheet = lies->placement.pose;
  const std::uint64_t seed = Random(world_.truth().settings.seed, "capture", static_cast<std::uint64_t>(number)).next();
  truth.dust = dust_of_scan(truth, seed);
  const fs::path file = world_.state_dir() / "captures" / (truth.capture + ".ppm");
  if (Status s = write_picture(file, render_scan(truth, lies ? lies->sheet.get() : nullptr, seed)); !s.ok())
    return s.error();
  if (Status s = save_scan_truth(truth, world_.state_dir() / "truth" / (truth.capture + ".json")); !s.ok())
    return s.error();
  forget_old("capture", number, 8);
  return json{{"file", file.string()}, {"dpi", dpi}, {"capture", truth.capture}};
}

// For somebody who only watches: small, and not among the numbered pictures, whose noise and light are drawn by their
// number: nothing comes out otherwise because somebody watched.
TwinService::Reply TwinService::glance(const BedView& view) {
  if (!glancing_eye_) {
    constexpr double kSmaller = 0.25;
    CameraTruth small = world_.truth().camera;
    small.width_px = std::max(1, static_cast<int>(small.width_px * kSmaller));
    small.height_px = std::max(1, static_cast<int>(small.height_px * kSmaller));
    for (double* length : {&small.fx, &small.fy, &small.cx, &small.cy}) *length *= kSmaller;
    glancing_eye_.emplace(small, world_.truth().settings.bed);
  }
  cv::Mat picture = glancing_eye_->picture(view, world_.truth().settings.seed, world_.truth().settings.rough);
  if (camera_dark_) picture *= 0.02;
  const fs::path file = world_.state_dir() / "captures" / "glance.ppm";
  if (Status s = write_picture(file, picture); !s.ok()) return s.error();
  return json{{"file", file.string()}};
}

TwinService::Reply TwinService::camera(const json& r) {
  if (camera_dead_) return Error{ErrorCode::kUnavailable, "the bed camera does not answer: check its cable"};
  const std::optional<PlacedSheet> lies = world_.snapshot(Spot::kBed);
  BedView view;
  json record = {{"schema_version", 1}, {"sheet", nullptr}};
  if (lies) {
    view = {lies->sheet.get(), lies->placement.face, lies->placement.pose,
            lies->placement.height_mm + lies->sheet->thickness_mm};
    record = {{"schema_version", 1},
              {"sheet", lies->sheet->name},
              {"face_up", to_string(view.face_up)},
              {"bed_from_sheet", to_json(view.bed_from_sheet)},
              {"face_height_mm", view.face_height_mm}};
  }
  if (r.value("glance", false)) return glance(view);
  const int number = world_.next_picture("camera");
  const std::uint64_t seed = Random(world_.truth().settings.seed, "camera", static_cast<std::uint64_t>(number)).next();
  if (!eye_) eye_.emplace(world_.truth().camera, world_.truth().settings.bed);
  cv::Mat picture = eye_->picture(view, seed, world_.truth().settings.rough);
  if (camera_dark_) picture *= 0.02;
  const std::string name = fmt::format("camera-{}", number);
  const fs::path file = world_.state_dir() / "captures" / (name + ".ppm");
  if (Status s = write_picture(file, picture); !s.ok()) return s.error();
  if (Status s = write_json(world_.state_dir() / "truth" / (name + ".json"), record); !s.ok()) return s.error();
  forget_old("camera", number, 4);
  return json{{"file", file.string()}, {"capture", name}};
}

// Pictures are large; the cell has read the old ones.
void TwinService::forget_old(const std::string& kind, int newest, int kept) const {
  std::error_code ignored;
  fs::remove(world_.state_dir() / "captures" / fmt::format("{}-{}.ppm", kind, newest - kept), ignored);
}

TwinService::Reply TwinService::lid(const json& r) {
  laser_.set_lid(r.at("open"));
  return json::object();
}

TwinService::Reply TwinService::power(const json& r) {
  laser_.set_power(r.at("laser"));
  return json::object();
}

TwinService::Reply TwinService::consent(const json& r) {
  laser_.set_consent(r.at("given"));
  return json::object();
}

TwinService::Reply TwinService::signal_at_burn(const json& r) {
  laser_.signal_at_burn({r.at("pid"), r.at("signal"), r.at("burnt_mm")});
  return json::object();
}

TwinService::Reply TwinService::fill_disk_at_burn(const json& r) {
  SignalAtBurn::Order order;
  order.pid = r.at("pid"), order.burnt_mm = r.at("burnt_mm"), order.fills_disk = true;
  laser_.signal_at_burn(order);
  return json::object();
}

TwinService::Reply TwinService::send_at_burn(const json& r) {
  SignalAtBurn::Order order;
  order.burnt_mm = r.at("burnt_mm"), order.socket = r.at("socket"), order.text = r.at("text");
  laser_.signal_at_burn(order);
  return json::object();
}

TwinService::Reply TwinService::fault(const json& r) {
  const std::string name = r.at("name");
  const json value = r.value("value", json());
  const std::array<std::pair<std::string_view, std::atomic<bool>*>, 3> switches = {
      {{"scanner_dead", &scanner_dead_}, {"camera_dead", &camera_dead_}, {"camera_dark", &camera_dark_}}};
  for (const auto& [fault, flag] : switches) {
    if (name != fault) continue;
    if (!value.is_null() && !value.is_boolean()) return invalid(fmt::format("fault {} is true or false", name));
    *flag = value.is_null() || value.get<bool>();
    return json::object();
  }
  if (name == "none") {
    for (const auto& [fault, flag] : switches) *flag = false;
    return json::object();
  }
  if (name == "laser_unplug") return laser_.unplug(), json::object();
  if (name == "laser_replug") return done(laser_.replug());
  if (name == "axis_drift") {
    if (!value.is_number() || !(std::abs(value.get<double>()) <= 0.05)) {
      return invalid("fault axis_drift needs a \"value\" from -0.05 to 0.05, the relative change of scale");
    }
    drifted_ += value.get<double>();
    world_.drift_axes(value.get<double>());
    return json::object();
  }
  if (!value.is_null() && !value.is_number())
    return invalid(fmt::format("\"value\" of fault {} must be a number", name));
  FaultRequest request{name, {}, {}};
  if (value.is_number()) request.value = value.get<double>();
  if (r.contains("after")) request.after = r.at("after").get<double>();
  const auto possible = [](const std::optional<double>& n) { return !n || (*n >= 1 && *n <= 1e12); };
  if (!possible(request.after)) return invalid(fmt::format("fault {} happens after 1 or more", name));
  const Status set = laser_.inject(request);
  if (!set && set.error().code == ErrorCode::kNotFound)
    return Error{
        ErrorCode::kNotFound,
        fmt::format("{}; or scanner_dead, camera_dead, camera_dark, laser_unplug, laser_replug, axis_drift, none",
                    set.error().message)};
  return done(set);
}

TwinService::Reply TwinService::burn_log(const json&) {
  json sheets = json::array();
  for (const BurnSummary& b : world_.burn_summary()) {
    sheets.push_back({{"sheet", b.sheet},
                      {"strokes", b.strokes},
                      {"pieces", b.pieces},
                      {"through_mm", b.through_mm},
                      {"engraved_mm", b.engraved_mm}});
  }
  return json{{"sheets", sheets}, {"watchdog", laser_.describe().value("watchdog", json::object())}};
}

}  // namespace veneer::sim
