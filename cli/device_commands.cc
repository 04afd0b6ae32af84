// device ...: which laser, scanner and camera the cell has, and choosing them; restart.
#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

constexpr const char* kDevices[] = {"laser", "scanner", "camera"};

std::string what_it_is(const json& device) {
  const std::string kind = text_or(device, "kind", "?");
  if (kind == "sim") return "simulated";
  const std::string size = device.contains("width") ? picture_words(device) : "";
  return joined({joined({kind, text_or(device, "port", text_or(device, "device", ""))}, " "), size}, ", ");
}

std::string why(const json& device, const std::string& file) {
  const std::string set_by = text_or(device, "set_by", "");
  if (set_by == "file") return "written in " + file;
  return set_by == "choice" ? "chosen" : "nothing is chosen";
}

// A viewer is not told where it lies.
std::string file_of(const json& told) {
  const std::string file = text_or(told, "file", "");
  return file.empty() ? "the configuration" : file;
}

std::string render_devices(const json& told) {
  TextTable table({"DEVICE", "IS", "BECAUSE", "FROM THE NEXT START"});
  const json& next = member(told, "next");
  for (const char* name : kDevices) {
    const json &now = member(told, name), &then = member(next, name);
    table.add(
        {name, what_it_is(now), why(now, file_of(told)), then.is_object() && then != now ? what_it_is(then) : ""});
  }
  std::string out = table.str();
  if (!flag_or(told, "choose", true))
    out += fmt::format("\nNothing is chosen here: choose = true under [devices] in {} would let a maintainer\n",
                       file_of(told));
  if (const std::string folder = text_or(told, "camera_folder", ""); !folder.empty())
    out += fmt::format("\nThe camera's folder: {}\n", folder);
  if (const std::string problem = text_or(told, "problem", ""); !problem.empty())
    out += fmt::format("\nAs things are the cell would not start again: {}\n", problem);
  if (next.is_object()) {
    const std::string refused = text_or(told, "restart_refused", "");
    out += refused.empty() ? "\nNext: veneerctl restart\n" : fmt::format("\nNot restarted yet: {}\n", refused);
  }
  return out;
}

std::string laser_line(const json& laser) {
  const std::string port = text_or(laser, "port", ""), name = text_or(laser, "name", "");
  if (const std::string refusal = text_or(laser, "refusal", ""); !refusal.empty())
    return fmt::format("# {}{}{}: {}\n", port, name.empty() ? "" : ", ", name, refusal);
  const bool by_socket = text_or(laser, "named_by", "") == "socket";
  std::vector<std::string> remarks = {name, by_socket ? "this is the socket: leave it plugged in there" : ""};
  const std::string remark = joined(remarks, "; "), kind = text_or(laser, "kind", "");
  return fmt::format("veneerctl device choose laser {} \"{}\"{}{}{}\n", kind, port,
                     kind == "lihuiyu" ? " --board M2_OR_M3 --travel-x MM --travel-y MM" : "",
                     remark.empty() ? "" : "   # ", remark);
}

std::string render_plugged_in(const json& told) {
  std::string out;
  for (const json& laser : member(told, "lasers")) out += laser_line(laser);
  for (const json& picture : member(told, "pictures"))
    out += fmt::format("veneerctl device choose camera file \"{}\"   # written {} ago\n",
                       text_or(picture, "device", ""), duration_words(number_or(picture, "age_s", 0)));
  if (out.empty()) out = "No laser is plugged in, and no picture lies in the camera's folder.\n";
  return out +
         "Scanners: veneerctl scanner list, then veneerctl device choose scanner sane \"MAKE AND MODEL\"\n"
         "Cameras on this computer: veneerctl camera list, then veneerctl camera try DEVICE\n";
}

struct Wanted {
  std::string device, kind, address;
  std::optional<std::string> board;
  std::optional<double> dpi, travel_x, travel_y;
  std::optional<std::int64_t> trial;
  std::vector<std::string> confirmed;

  json body() const {
    json out = {{"kind", kind}};
    if (!address.empty()) out[device == "laser" ? "port" : "device"] = address;
    if (board) out["board"] = *board;
    if (dpi) out["dpi"] = *dpi;
    if (travel_x) out["travel_x_mm"] = *travel_x;
    if (travel_y) out["travel_y_mm"] = *travel_y;
    if (trial) out["trial"] = *trial;
    if (!confirmed.empty()) out["confirmed"] = confirmed;
    return out;
  }
};

void add_choose(CLI::App& device, CommandContext& context) {
  const auto wanted = std::make_shared<Wanted>();
  CLI::App* choose = device.add_subcommand("choose", "Say which one it is, from the next start on");
  choose->add_option("DEVICE", wanted->device, "laser, scanner or camera")
      ->required()
      ->check(CLI::IsMember({"laser", "scanner", "camera"}));
  choose
      ->add_option("KIND", wanted->kind,
                   "sim; for a laser grbl or lihuiyu, for a scanner sane, for a camera v4l2 or file")
      ->required()
      ->check(CLI::IsMember({"sim", "grbl", "lihuiyu", "sane", "v4l2", "file"}));
  choose->add_option("ADDRESS", wanted->address,
                     "Its port, make, name or picture, as `device find`, `scanner list` or `camera list` tells it");
  choose->add_option("--board", wanted->board, "For a Lihuiyu laser: m2 or m3")->check(CLI::IsMember({"m2", "m3"}));
  choose->add_option("--travel-x", wanted->travel_x, "For a Lihuiyu laser: its travel across, mm")
      ->check(CLI::Range(50, 2000));
  choose->add_option("--travel-y", wanted->travel_y, "For a Lihuiyu laser: its travel in depth, mm")
      ->check(CLI::Range(50, 2000));
  choose->add_option("--dpi", wanted->dpi, "For a scanner: the resolution; else as configured")
      ->check(CLI::Range(75, 1200));
  choose
      ->add_option(
          "--trial", wanted->trial,
          "For a camera of this computer: the number of the picture that was looked at, as `camera try` tells it")
      ->check(CLI::PositiveNumber);
  add_confirm_option(*choose, wanted->confirmed);
  choose->callback([wanted, &context] {
    context.finish_step(context.client().post("/devices/" + wanted->device, wanted->body()), render_devices);
  });
}

}  // namespace

void add_device_commands(CLI::App& app, CommandContext& context) {
  CLI::App* device = app.add_subcommand("device", "Which laser, scanner and camera the cell has");
  device->require_subcommand(1);
  CLI::App* list = device->add_subcommand("list", "What is in force, why, and what the next start takes");
  list->callback([&context] { context.finish(context.client().get("/devices"), render_devices); });
  CLI::App* find = device->add_subcommand("find", "Lasers that are plugged in, and pictures of cameras");
  find->callback([&context] { context.finish(context.client().get("/devices/found"), render_plugged_in); });
  add_choose(*device, context);
  CLI::App* restart =
      app.add_subcommand("restart", "End veneerd in order and have it started again, when nothing is going on");
  restart->callback([&context] {
    context.finish(context.client().post("/restart"), [](const json&) {
      return "The cell starts again. It moves nothing before somebody says Reset; `veneerctl next` says what comes "
             "first.\n";
    });
  });
}

}  // namespace veneer::cli
