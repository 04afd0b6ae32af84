#include "daemon/config_devices.h"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>

namespace veneer::daemon {
namespace {

constexpr std::string_view kLeftOpen = "chosen";
constexpr std::string_view kNeedsKind =
    "belongs to a device that is named here: write its kind beside it, or take it out";

// What of it the device takes is known when it is asked to scan, and by veneerctl scanner list.
void read_sane(Section& scanner, ScannerConfig& out) {
  scanner.text("mode", out.mode);
  scanner.text("source", out.source);
  scanner.integer("depth", out.depth, {8, 16});
  scanner.numbers("area_mm", out.area_mm, 4, 0, 2000);
  scanner.settings("options", out.options);
}

// The kind and who set it. True when the page did, and the rest of it is in `chosen`.
bool read_kind(Section& configured, Section& chosen, std::string& kind, SetBy& set_by,
               std::initializer_list<std::string_view> kinds) {
  std::string written(kLeftOpen);
  std::vector<std::string_view> words(kinds);
  words.push_back(kLeftOpen);
  configured.word("kind", written, words);
  if (written != kLeftOpen) {
    kind = written;
    set_by = SetBy::kFile;
    return false;
  }
  if (!chosen.has("kind")) return false;
  chosen.word("kind", kind, kinds);
  set_by = SetBy::kPage;
  return true;
}

void read_travel(Section& laser, LaserConfig& out) {
  laser.quantity("travel_x_mm", out.travel_x, 50, 2000);
  laser.quantity("travel_y_mm", out.travel_y, 50, 2000);
}

void read_laser(Section& configured, Section& chosen, LaserConfig& out) {
  if (read_kind(configured, chosen, out.kind, out.set_by, {"grbl", "lihuiyu", "sim"})) {
    chosen.text("port", out.port);
    if (out.kind == "lihuiyu") {
      chosen.word("board", out.board, {"m2", "m3"});
      read_travel(chosen, out);
    }
  } else if (out.set_by == SetBy::kFile) {
    configured.text("port", out.port);
    configured.truth("test_controller", out.test_controller);
    if (out.kind == "lihuiyu") configured.word("board", out.board, {"m2", "m3"});
    if (out.kind == "lihuiyu" || records(out)) read_travel(configured, out);
  }
  if (out.set_by != SetBy::kFile)
    configured.refuse({"port", "test_controller", "board", "travel_x_mm", "travel_y_mm"}, kNeedsKind);
  if (out.kind != "lihuiyu")
    if (const auto z = configured.number("focus_z_mm", -1000, 1000)) out.focus_z = Millimetres(*z);
}

void read_scanner(Section& configured, Section& chosen, ScannerConfig& out) {
  const bool by_page = read_kind(configured, chosen, out.kind, out.set_by, {"file", "sane", "sim"});
  configured.number("dpi", out.dpi, 75, 1200);
  if (by_page) {
    chosen.text("device", out.device);
    chosen.number("dpi", out.dpi, 75, 1200);
  }
  if (out.set_by == SetBy::kFile)
    configured.text("device", out.device);
  else
    configured.refuse({"device"}, kNeedsKind);
  if (out.kind == "sane" && !by_page)
    read_sane(configured, out);
  else
    configured.only_for("sane", {"mode", "source", "depth", "area_mm", "options"});
  // Which scanners there are can be asked for whatever the kind.
  configured.folder("sane_config_dir", out.sane_config);
}

void read_camera(Section& configured, Section& chosen, CameraConfig& out) {
  if (read_kind(configured, chosen, out.kind, out.set_by, {"file", "sim"}))
    chosen.text("device", out.device);
  else if (out.set_by == SetBy::kFile)
    configured.text("device", out.device);
  if (out.set_by != SetBy::kFile) configured.refuse({"device"}, kNeedsKind);
  configured.integer("look_every_pieces", out.look_every, 0, 100000);
}

// As TOML; there are no control characters in it.
std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace

void read_devices(const DeviceTables& configured, const DeviceTables& chosen, Config& config,
                  std::vector<std::string>& errors) {
  const auto both = [&](std::string_view name, auto read, auto& out) {
    Section by_hand(configured.root, configured.name, name, errors), by_page(chosen.root, chosen.name, name, errors);
    read(by_hand, by_page, out);
    by_hand.refuse_unread();
    // What was chosen before the file named the device is not used, and nobody reads it.
    if (out.set_by == SetBy::kPage) by_page.refuse_unread();
  };
  both("laser", read_laser, config.laser);
  both("scanner", read_scanner, config.scanner);
  both("camera", read_camera, config.camera);
  Section sim(configured.root, configured.name, "sim", errors);
  sim.path("socket", config.sim.socket);
  sim.path("laser", config.sim.laser);
  sim.number("time_scale", config.sim.time_scale, 1, 1000);
  sim.refuse_unread();
}

std::string chosen_devices_text(const Config& config) {
  std::string out = "# What was chosen on the page, Set up. It counts where veneerd.toml leaves a device open.\n";
  if (const LaserConfig& laser = config.laser; laser.set_by == SetBy::kPage) {
    out += fmt::format("[laser]\nkind = {}\n", toml_text(laser.kind));
    if (laser.kind != "sim") out += fmt::format("port = {}\n", toml_text(laser.port));
    if (laser.kind == "lihuiyu")
      out += fmt::format("board = {}\ntravel_x_mm = {}\ntravel_y_mm = {}\n", toml_text(laser.board),
                         laser.travel_x.count(), laser.travel_y.count());
  }
  if (const ScannerConfig& scanner = config.scanner; scanner.set_by == SetBy::kPage)
    out += fmt::format("[scanner]\nkind = {}\ndevice = {}\ndpi = {}\n", toml_text(scanner.kind),
                       toml_text(scanner.device), scanner.dpi);
  if (const CameraConfig& camera = config.camera; camera.set_by == SetBy::kPage)
    out += fmt::format("[camera]\nkind = {}\ndevice = {}\n", toml_text(camera.kind), toml_text(camera.device));
  return out;
}

}  // namespace veneer::daemon
