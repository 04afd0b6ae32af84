// Cameras and what can be set on them, in words.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/json_read.h"
#include "cli/render.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string control_takes(const json& control) {
  if (text_or(control, "kind", "") == "yes_no") return "0 or 1";
  std::string text;
  if (const json& choices = member(control, "choices"); choices.is_array())
    for (const json& choice : choices)
      text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", whole_or(choice, "value", 0),
                          text_or(choice, "title", "?"));
  if (!text.empty()) return text;
  text = fmt::format("{} to {}", whole_or(control, "least", 0), whole_or(control, "most", 0));
  if (const auto step = whole_or(control, "step", 1); step > 1) text += fmt::format(" in steps of {}", step);
  return text;
}

std::string control_line(const json& control) {
  std::string text = fmt::format("  {:<30} {}, now {}, default {}", text_or(control, "name", "?"),
                                 control_takes(control), whole_or(control, "value", 0), whole_or(control, "usual", 0));
  if (!flag_or(control, "settable", true)) text += ", cannot be set";
  return text + "\n";
}

// "  YUYV  640 x 480, 1920 x 1080"
std::string format_lines(const json& formats) {
  std::map<std::string, std::vector<std::pair<std::int64_t, std::string>>> sizes;
  for (const json& one : formats) {
    const auto width = whole_or(one, "width", 0), height = whole_or(one, "height", 0);
    const auto most_width = whole_or(one, "most_width", width), most_height = whole_or(one, "most_height", height);
    std::string words = fmt::format("{} x {}", width, height);
    if (most_width != width || most_height != height) words += fmt::format(" to {} x {}", most_width, most_height);
    sizes[text_or(one, "code", "?")].emplace_back(most_width * most_height, std::move(words));
  }
  std::string text;
  for (auto& [code, of_it] : sizes) {
    std::ranges::sort(of_it);
    std::string list;
    for (const auto& [pixels, words] : of_it) list += (list.empty() ? "" : ", ") + words;
    text += fmt::format("  {:<5} {}\n", code, list);
  }
  return text;
}

// What it cannot be locked in, by the names that Linux gives settings; a lens that does not move has none either.
std::string missing_lines(const json& controls) {
  const auto has = [&](std::string_view part) {
    return std::ranges::any_of(
        controls, [&](const json& control) { return text_or(control, "name", "").find(part) != std::string::npos; });
  };
  std::string text;
  if (!has("exposure"))
    text += "  (it has no setting of its exposure: if it changes that itself, nobody can switch that off)\n";
  if (!has("focus")) text += "  (it has no setting of its focus: use it only if its lens does not move by itself)\n";
  return text;
}

std::string doubt_words(const std::string& doubt) {
  if (doubt == "unsettled")
    return "Its automatic settings never came to rest: keep the bed still and its light on, and try it again.";
  if (doubt == "too_dark")
    return "The picture is too dark, or darker than with its automatic settings: light the bed, or take a longer "
           "exposure: give all settings above again with --set, and exposure_time_absolute changed.";
  if (doubt == "too_bright")
    return "The picture is too bright: keep lamps out of its sight, or take a shorter exposure: give all settings "
           "above "
           "again with --set, and exposure_time_absolute changed.";
  if (doubt == "blurred")
    return "The picture is less sharp than with its automatic settings: take another focus: give all settings above "
           "again "
           "with --set, and focus_absolute changed.";
  return "Something speaks against this picture: " + doubt;
}

std::string name_line(const json& camera) {
  const std::string device = text_or(camera, "device", "");
  if (device.empty())
    return fmt::format("  {} is no name that lasts, and it has no other: install udev, then plug it in again\n",
                       text_or(camera, "node", "?"));
  return fmt::format("  device = \"{}\"\n{}", device,
                     text_or(camera, "named_by", "") == "socket"
                         ? "  (it has no serial number of its own: whatever is plugged into this socket is it)\n"
                         : "");
}

}  // namespace

std::string render_cameras(const json& found) {
  const json& cameras = member(found, "cameras");
  if (!cameras.is_array() || cameras.empty())
    return "No camera is found. Plug it into this computer; docs/CALIBRATION.md says which can be used.\n";
  std::string text;
  for (const json& camera : cameras) {
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n", text_or(camera, "name", "?")) + name_line(camera);
    if (const std::string problem = text_or(camera, "problem", ""); !problem.empty()) text += "  " + problem + "\n";
    if (const json& formats = member(camera, "formats"); formats.is_array()) text += format_lines(formats);
    const json& controls = member(camera, "controls");
    if (!controls.is_array()) continue;
    for (const json& control : controls) text += control_line(control);
    if (text_or(camera, "problem", "").empty()) text += missing_lines(controls);
  }
  const bool any = std::ranges::any_of(cameras, [](const json& camera) {
    return !text_or(camera, "device", "").empty() && text_or(camera, "problem", "").empty();
  });
  if (!any) return text;
  return text + "\nNext: veneerctl camera try DEVICE takes a picture with one of them and says how to choose it.\n";
}

std::string picture_words(const json& camera) {
  std::string text = fmt::format("{} x {} {}", whole_or(camera, "width", 0), whole_or(camera, "height", 0),
                                 text_or(camera, "format", "?"));
  if (const json& settings = member(camera, "settings"); settings.is_object())
    for (const auto& [name, value] : settings.items())
      if (value.is_string()) text += fmt::format(", {} {}", name, value.get<std::string>());
  return text;
}

std::string render_trial(const json& trial) {
  const std::string device = text_or(trial, "device", "?");
  std::string text = fmt::format("{}\n  {}\n", device, picture_words(trial));
  if (const json& doubts = member(trial, "doubts"); doubts.is_array())
    for (const json& doubt : doubts)
      text += "  " + doubt_words(doubt.is_string() ? doubt.get<std::string>() : "") + "\n";
  const std::string saved = text_or(trial, "saved", "");
  if (saved.empty())
    return text + "Nobody has seen this picture: take it again with --out FILE, look at it, then choose the camera.\n";
  return text + fmt::format("The picture so taken: {}\n", saved) +
         fmt::format("Next, when the picture is good: veneerctl device choose camera v4l2 \"{}\" --trial {}\n", device,
                     whole_or(trial, "trial", 0));
}

}  // namespace veneer::cli
