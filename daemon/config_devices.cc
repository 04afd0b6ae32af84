#include "daemon/config_devices.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <system_error>

#include "base/files.h"
#include "drivers/camera_size.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

// What of it the device takes is known when it is asked to scan, and by veneerctl scanner list.
void read_sane(Section& scanner, ScannerConfig& out) {
  scanner.text("mode", out.mode);
  scanner.text("source", out.source);
  scanner.integer("depth", out.depth, {8, 16});
  scanner.numbers("area_mm", out.area_mm, 4, 0, 2000);
  scanner.settings("options", out.options);
}

// Of a camera, written or chosen. What of it the device takes is known when it is asked for a picture.
void read_picture_of_v4l2(Section& camera, auto& out) {
  camera.integer("width", out.width, kLeastCameraSide, kMostCameraSide);
  camera.integer("height", out.height, kLeastCameraSide, kMostCameraSide);
  camera.word("format", out.format, {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY", "MJPG", "JPEG"});
  camera.settings("options", out.options);
}

bool is_name_of_camera(const fs::path& device, bool below_dev) {
  const fs::path folder = device.parent_path();
  const bool lasts = folder.filename() == "by-id" || folder.filename() == "by-path";
  const bool is_name = device.has_filename() && device.filename() != "." && device.filename() != "..";
  if (below_dev && folder.parent_path() != "/dev/v4l") return false;
  return device.is_absolute() && lasts && is_name && folder.parent_path().filename() == "v4l";
}

// What of it the device takes is known when it is asked for a picture, and by veneerctl camera list.
void read_v4l2(Section& camera, CameraConfig& out, const std::string& file, std::vector<std::string>& errors) {
  read_picture_of_v4l2(camera, out);
  camera.integer("frames", out.frames, 1, 64);
  // The same size in another format is seldom the same part of the sensor, so it is not left to chance.
  for (const char* needed : {"device", "width", "height", "format"})
    if (!camera.has(needed))
      errors.push_back(fmt::format(
          "{}: camera.{} is missing, which kind = \"v4l2\" needs: veneerctl camera list has it", file, needed));
  if (std::int64_t{out.width} * out.height > kMostCameraPixels)
    errors.push_back(
        fmt::format("{}: camera.width = {} and camera.height = {} make more than {} million pixels: use a "
                    "smaller size that veneerctl camera list has",
                    file, out.width, out.height, kMostCameraPixels / 1'000'000));
  // udev names cameras there and nothing else, least of all a laser; and "/dev/video0" goes to whichever is found
  // first.
  if (camera.has("device") && !is_name_of_camera(out.device, true))
    errors.push_back(
        fmt::format("{}: camera.device = \"{}\" is no lasting name of a camera: use one below /dev/v4l/by-id "
                    "or /dev/v4l/by-path that veneerctl camera list has",
                    file, out.device));
}

void read_travel(Section& laser, Millimetres& x, Millimetres& y) {
  laser.quantity("travel_x_mm", x, 50, 2000);
  laser.quantity("travel_y_mm", y, 50, 2000);
}

// ---- chosen_devices.toml --------------------------------------------------------------------------------------------

// As TOML; there are no control characters in it.
std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

Error not_whole(const fs::path& file, const std::string& problem) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("{} does not say which devices were chosen ({}), and a cell does not become another one by "
                      "itself: put it back from a copy, or remove it and choose laser, scanner and camera again",
                      file.string(), problem)};
}

// What is in it is nobody's fault then, and stays.
Error not_readable(const fs::path& file, const std::error_code& why) {
  return {ErrorCode::kStorage,
          fmt::format("{}, which says what devices were chosen, cannot be read ({}): let the user that veneerd runs as "
                      "read it and the folders it lies in, and look whether its disk is well",
                      file.string(), why.message())};
}

bool has_kind(Section& section, std::string_view device, std::vector<std::string>& errors) {
  if (section.has("kind")) return true;
  errors.push_back(fmt::format("the kind of the {} is missing", device));
  return false;
}

void read_chosen_laser(Section& section, ChosenDevices::Laser& out, std::vector<std::string>& errors) {
  if (!has_kind(section, "laser", errors)) return;
  section.word("kind", out.kind, {"grbl", "lihuiyu", "sim"});
  if (out.kind == "sim") return;
  section.text("port", out.port);
  if (!out.port.starts_with(out.kind == "grbl" ? "serial:/" : "usb:"))
    errors.push_back(fmt::format("laser.port = \"{}\" is no port of a laser that can be chosen", out.port));
  if (out.kind != "lihuiyu") return;
  // A guess would drive the head against its frame.
  for (const char* needed : {"board", "travel_x_mm", "travel_y_mm"})
    if (!section.has(needed)) errors.push_back(fmt::format("laser.{} is missing", needed));
  section.word("board", out.board, {"m2", "m3"});
  read_travel(section, out.travel_x, out.travel_y);
}

void read_chosen_scanner(Section& section, ChosenDevices::Scanner& out, std::vector<std::string>& errors) {
  if (!has_kind(section, "scanner", errors)) return;
  section.word("kind", out.kind, {"sane", "sim"});
  if (out.kind == "sim") return;
  section.text("device", out.device);
  if (out.device.empty()) errors.emplace_back("scanner.device is missing");
  out.dpi = section.number("dpi", 75, 1200);
}

void read_chosen_camera(Section& section, ChosenDevices::Camera& out, std::vector<std::string>& errors) {
  if (!has_kind(section, "camera", errors)) return;
  section.word("kind", out.kind, {"file", "v4l2", "sim"});
  if (out.kind == "sim") return;
  section.text("device", out.device);
  if (out.kind == "v4l2") {
    // A guess would be another part of the sensor, or another focus, than the one that is calibrated.
    for (const char* needed : {"width", "height", "format"})
      if (!section.has(needed)) errors.push_back(fmt::format("camera.{} is missing", needed));
    read_picture_of_v4l2(section, out);
    if (std::int64_t{out.width} * out.height > kMostCameraPixels)
      errors.push_back(fmt::format("camera.width and camera.height make more than {} million pixels",
                                   kMostCameraPixels / 1'000'000));
    if (!is_name_of_camera(out.device, false))
      errors.push_back(fmt::format("camera.device = \"{}\" is no lasting name of a camera", out.device));
    return;
  }
  if (out.device.empty())
    errors.emplace_back("camera.device is missing");
  else if (!out.device.starts_with('/'))
    errors.push_back(fmt::format("camera.device = \"{}\" is no picture's whole path", out.device));
}

}  // namespace

BeforeMotionConfig usual_before_motion(const LaserConfig& laser) {
  if (laser.kind == "sim") return {};
  return {{"exhaust", "air assist", "cooling"}, true};
}

void read_devices(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors) {
  Section devices(root, file, "devices", errors);
  devices.truth("choose", config.devices.choose);
  devices.refuse_unread();
  Section laser(root, file, "laser", errors);
  laser.word("kind", config.laser.kind, {"grbl", "lihuiyu", "sim"});
  laser.text("port", config.laser.port);
  laser.truth("test_controller", config.laser.test_controller);
  if (config.laser.kind == "lihuiyu") laser.word("board", config.laser.board, {"m2", "m3"});
  if (config.laser.kind == "lihuiyu" || records(config.laser))
    read_travel(laser, config.laser.travel_x, config.laser.travel_y);
  if (config.laser.kind != "lihuiyu")
    if (const auto z = laser.number("focus_z_mm", -1000, 1000)) config.laser.focus_z = Millimetres(*z);
  laser.refuse_unread();
  Section scanner(root, file, "scanner", errors);
  scanner.word("kind", config.scanner.kind, {"file", "sane", "sim"});
  scanner.text("device", config.scanner.device);
  scanner.number("dpi", config.scanner.dpi, 75, 1200);
  if (config.scanner.kind == "sane")
    read_sane(scanner, config.scanner);
  else
    scanner.only_for("sane", {"mode", "source", "depth", "area_mm", "options"});
  // Which scanners there are can be asked for whatever the kind.
  scanner.folder("sane_config_dir", config.scanner.sane_config);
  scanner.refuse_unread();
  Section camera(root, file, "camera", errors);
  camera.word("kind", config.camera.kind, {"file", "v4l2", "sim", "v4l"});
  if (config.camera.kind == "v4l")
    config.camera.kind = "v4l2";  // by the name of its predecessor, which some know it by
  camera.text("device", config.camera.device);
  if (config.camera.kind == "v4l2")
    read_v4l2(camera, config.camera, file, errors);
  else
    camera.only_for("v4l2", {"width", "height", "frames", "format", "options"});
  camera.integer("look_every_pieces", config.camera.look_every, 0, 100000);
  camera.refuse_unread();
  Section sim(root, file, "sim", errors);
  sim.path("socket", config.sim.socket);
  sim.path("laser", config.sim.laser);
  sim.number("time_scale", config.sim.time_scale, 1, 1000);
  sim.refuse_unread();
  if (!config.devices.choose) return;
  const auto leave_open = [](auto& device) { device.set_by = device.kind == "sim" ? SetBy::kNobody : SetBy::kFile; };
  leave_open(config.laser);
  leave_open(config.scanner);
  leave_open(config.camera);
}

Result<ChosenDevices> read_chosen_devices(std::string_view text, const fs::path& file) {
  ChosenDevices out;
  std::vector<std::string> errors;
  try {
    const toml::table root = toml::parse(text, file.string());
    const auto one = [&](std::string_view name, auto read, auto& into) {
      std::vector<std::string> of_it;
      Section section(root, file.filename().string(), name, of_it);
      read(section, into, of_it);
      section.refuse_unread();
      errors.insert(errors.end(), of_it.begin(), of_it.end());
    };
    one("laser", read_chosen_laser, out.laser);
    one("scanner", read_chosen_scanner, out.scanner);
    one("camera", read_chosen_camera, out.camera);
    for (auto&& [key, node] : root)
      if (key != "laser" && key != "scanner" && key != "camera")
        errors.push_back(fmt::format("[{}] in line {} is no device", key.str(), node.source().begin.line));
  } catch (const toml::parse_error& e) {
    errors.push_back(fmt::format("line {}: {}", e.source().begin.line, e.description()));
  }
  if (!errors.empty()) return not_whole(file, errors.front());
  return out;
}

Result<std::optional<ChosenDevices>> read_chosen_devices(const fs::path& file) {
  std::error_code error;
  const fs::file_status there = fs::symlink_status(file, error);
  if (there.type() == fs::file_type::not_found) return std::optional<ChosenDevices>();
  if (error) return not_readable(file, error);
  if (there.type() != fs::file_type::regular) return not_whole(file, "it is no plain file");
  if (::access(file.c_str(), R_OK) != 0) return not_readable(file, {errno, std::generic_category()});
  const auto text = read_whole(file);
  if (!text) return not_readable(file, std::make_error_code(std::errc::io_error));
  auto chosen = read_chosen_devices(*text, file);
  if (!chosen) return chosen.error();
  return std::optional(std::move(*chosen));
}

void take_chosen(const ChosenDevices& chosen, Config& config) {
  config.devices.chosen = chosen;
  if (config.laser.set_by == SetBy::kNobody && chosen.laser.kind != "sim") {
    LaserConfig laser;
    laser.set_by = SetBy::kChoice;
    laser.kind = chosen.laser.kind;
    laser.port = chosen.laser.port;
    laser.board = chosen.laser.board;
    laser.travel_x = chosen.laser.travel_x;
    laser.travel_y = chosen.laser.travel_y;
    config.laser = std::move(laser);
    BeforeMotionConfig asked = usual_before_motion(config.laser);
    for (const std::string& more : config.before_motion.confirm)
      if (std::ranges::find(asked.confirm, more) == asked.confirm.end()) asked.confirm.push_back(more);
    config.before_motion = std::move(asked);
  }
  if (config.scanner.set_by == SetBy::kNobody && chosen.scanner.kind != "sim") {
    config.scanner.set_by = SetBy::kChoice;
    config.scanner.kind = chosen.scanner.kind;
    config.scanner.device = chosen.scanner.device;
    config.scanner.dpi = chosen.scanner.dpi.value_or(config.scanner.dpi);
  }
  if (config.camera.set_by == SetBy::kNobody && chosen.camera.kind != "sim") {
    config.camera.set_by = SetBy::kChoice;
    config.camera.kind = chosen.camera.kind;
    config.camera.device = chosen.camera.device;
    config.camera.width = chosen.camera.width;
    config.camera.height = chosen.camera.height;
    config.camera.format = chosen.camera.format;
    config.camera.options = chosen.camera.options;
  }
}

std::string chosen_devices_text(const ChosenDevices& chosen) {
  std::string out =
      "# What was chosen on Set up or by veneerctl. It counts where veneerd.toml says [devices] choose = true and a\n"
      "# device is simulated. Choose there again rather than write here.\n";
  out += fmt::format("[laser]\nkind = {}\n", toml_text(chosen.laser.kind));
  if (chosen.laser.kind != "sim") out += fmt::format("port = {}\n", toml_text(chosen.laser.port));
  if (chosen.laser.kind == "lihuiyu")
    out += fmt::format("board = {}\ntravel_x_mm = {}\ntravel_y_mm = {}\n", toml_text(chosen.laser.board),
                       chosen.laser.travel_x.count(), chosen.laser.travel_y.count());
  out += fmt::format("[scanner]\nkind = {}\n", toml_text(chosen.scanner.kind));
  if (chosen.scanner.kind != "sim") {
    out += fmt::format("device = {}\n", toml_text(chosen.scanner.device));
    if (chosen.scanner.dpi) out += fmt::format("dpi = {}\n", *chosen.scanner.dpi);
  }
  out += fmt::format("[camera]\nkind = {}\n", toml_text(chosen.camera.kind));
  if (chosen.camera.kind != "sim") out += fmt::format("device = {}\n", toml_text(chosen.camera.device));
  if (chosen.camera.kind != "v4l2") return out;
  out += fmt::format("width = {}\nheight = {}\nformat = {}\n[camera.options]\n", chosen.camera.width,
                     chosen.camera.height, toml_text(chosen.camera.format));
  for (const auto& [name, value] : chosen.camera.options)
    out += fmt::format("{} = {}\n", toml_text(name), toml_text(value));
  return out;
}

}  // namespace veneer::daemon
