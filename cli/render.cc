#include "cli/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/json_read.h"
#include "cli/progress.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

// "feed 150 %, power 50 %"; "" when nothing is overridden.
std::string overrides_words(const json& overrides) {
  std::vector<std::string> parts;
  for (const char* what : {"feed", "rapid", "power"})
    if (const auto percent = whole_or(overrides, what, 100); percent != 100)
      parts.push_back(fmt::format("{} {} %", what, percent));
  return joined(parts, ", ");
}

std::string home_words(const json& laser) {
  const bool homed = flag_or(laser, "homed", false);
  if (flag_or(laser, "finds_home", true)) return homed ? "homed" : "not homed";
  return homed ? "no homing switches: counts from the corner it was given"
               : "no homing switches: does not count from its corner yet";
}

// The one that somebody chose; what is written in the configuration, its writer knows.
std::string chosen_words(const json& laser) {
  if (text_or(laser, "set_by", "") != "choice") return "";
  return "chosen: " + joined({text_or(laser, "kind", ""), text_or(laser, "port", "")}, " ");
}

std::string laser_words(const json& laser) {
  if (!flag_or(laser, "connected", false)) {
    const std::string why = text_or(laser, "why_not_connected", "");
    return joined({why.empty() ? "not connected yet: `veneerctl reset` connects and homes it" : "NOT CONNECTED: " + why,
                   chosen_words(laser)},
                  "; ");
  }
  std::vector<std::string> parts = {"connected", text_or(laser, "state", "")};
  if (member(laser, "homed").is_boolean()) parts.push_back(home_words(laser));
  const json& position = member(laser, "position_mm");
  if (position.is_array() && position.size() == 2 && position[0].is_number() && position[1].is_number()) {
    parts.push_back(fmt::format("at {:.1f}, {:.1f} mm", position[0].get<double>(), position[1].get<double>()));
  }
  if (member(laser, "beam_on").is_boolean())
    parts.emplace_back(flag_or(laser, "beam_on", false) ? "BEAM ON" : "beam off");
  parts.push_back(text_or(laser, "firmware", ""));
  const std::string controller = text_or(laser, "controller", "");
  if (controller == "test") parts.emplace_back("a test controller, no laser");
  if (controller == "file") parts.emplace_back("it records to a file, no laser");
  parts.push_back(chosen_words(laser));
  return joined(parts, ", ");
}

std::string job_words(const json& job) {
  const auto pieces = whole_or(job, "pieces", 0);
  const auto cut = whole_or(job, "cut", 0);
  std::vector<std::string> parts = {fmt::format("{} \"{}\" ({})", whole_or(job, "id", 0), text_or(job, "name", ""),
                                                text_or(job, "now", text_or(job, "state", ""))),
                                    fmt::format("{} of {} pieces cut", cut, pieces)};
  if (const auto suspect = whole_or(job, "suspect", 0); suspect > 0)
    parts.push_back(fmt::format("{} SUSPECT", suspect));
  if (const std::string piece = text_or(job, "current_piece", ""); !piece.empty()) parts.push_back("now " + piece);
  if (member(job, "eta_s").is_number())
    parts.push_back("about " + duration_words(number_or(job, "eta_s", 0)) + " left");
  return joined(parts, ", ");
}

std::string load_words(const json& load) {
  const bool found = flag_or(load, "found", false);
  const std::string fit = millimetres(load, "rms_mm", 3);
  return joined({fmt::format("{}, {} up: {}{}", text_or(load, "panel", "?"), text_or(load, "face_up", "?"),
                             found ? "found" : "NOT FOUND YET", found && !fit.empty() ? " (" + fit + ")" : ""),
                 text_or(load, "sentence", "")},
                "; ");
}

// "other_device" as a person says it.
std::string state_words(std::string state) {
  std::replace(state.begin(), state.end(), '_', ' ');
  return state;
}

std::string loudly(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

std::string calibration_words(const json& calibration) {
  if (!calibration.is_object()) return "";
  std::vector<std::string> parts;
  for (const char* device : {"scanner", "camera", "axes", "kerf"}) {
    const std::string state = text_or(calibration, device, "");
    if (state.empty()) continue;
    parts.push_back(std::string(device) + " " + (state == "valid" ? state : loudly(state_words(state))));
  }
  return joined(parts, ", ");
}

std::string lid_words(const std::string& lid, bool connected) {
  if (lid == "open") return "OPEN";
  return lid == "unknown" && connected ? "not known, the laser's controller has told of no lid switch" : lid;
}

// "12 panels, of which 2 wait for a scan: P-0001, P-0002".
std::string stock_words(const json& status) {
  const auto panels = whole_or(status, "panels", 0);
  std::string text = fmt::format("{} panel{}", panels, panels == 1 ? "" : "s");
  const json& waiting = member(status, "panels_to_scan");
  const auto count = whole_or(waiting, "count", 0);
  if (count == 0) return text;
  const json& named = member(waiting, "panels");
  const auto more = count - static_cast<std::int64_t>(named.size());
  return fmt::format("{}, of which {} for a scan: {}{}", text, count == 1 ? "1 waits" : fmt::format("{} wait", count),
                     names_of(named), more > 0 ? fmt::format(" and {} more", more) : "");
}

// For states that explain themselves.
std::string what_next(const std::string& state) {
  if (state == "Stopped") return "`veneerctl reset` homes the laser and makes the cell ready: hands off the machine.";
  if (state == "Idle") return "Ready: `veneerctl job start N` starts a job.";
  if (state == "Complete") return "The job is done: take the pieces out, then `veneerctl reset`.";
  if (state == "Aborted") return "When the cause is gone: `veneerctl clear`, then `veneerctl reset`.";
  if (state == "Held") return "`veneerctl unhold` looks whether the panel lies as it did and goes on where it stopped.";
  return "";
}

// "There is no wood in stock: ... (veneerctl panel scan)". "" from a cell that tells none.
std::string next_step_words(const json& step) {
  const std::string command = text_or(step, "command", "");
  return text_or(step, "sentence", "") + (command.empty() ? "" : " (" + command + ")");
}

// {"panel", "face", "tiles", "retag"}: a scan of several tiles, which anybody may go on with.
std::string open_scan_words(const json& open) {
  const auto tiles = whole_or(open, "tiles", 0);
  const std::string panel = text_or(open, "panel", ""), face = text_or(open, "face", "show");
  const std::string named =
      fmt::format("{}{}{}", panel.empty() ? "" : " --panel " + panel, face == "show" ? "" : " --face " + face,
                  flag_or(open, "retag", false) ? " --retag" : "");
  return fmt::format(
      "{} of the {} face of {} {} scanned, and more is to come: veneerctl panel scan{} ends it with the "
      "last tile, --more goes on, --anew discards what is there",
      tiles == 1 ? "1 tile" : fmt::format("{} tiles", tiles), face,
      panel.empty() ? "a panel that was not named" : panel, tiles == 1 ? "is" : "are", named);
}

// What a person has to know and do before Unsuspend.
std::string before_motion_words(const json& load, const json& confirm) {
  std::string text;
  if (const double seconds = number_or(load, "estimate_s", 0); seconds > 0)
    text += line("Takes", seconds < 90 ? fmt::format("about {:.0f} s", std::max(1.0, seconds))
                                       : fmt::format("about {:.0f} min", seconds / 60));
  if (const double focus = number_or(load, "focus_mm", 0); focus > 0)
    text += line("Focus", fmt::format("{:.1f} mm above the bed, the panel's upper face", focus));
  std::string asked;
  if (confirm.is_array())
    for (const json& what : confirm)
      if (what.is_string()) asked += (asked.empty() ? "" : ", ") + what.get<std::string>();
  return text + line("Confirm", asked);
}

}  // namespace

namespace {

// What is not as it should be, with what to do; what nobody has told stands in the JSON.
std::string interlock_lines(const json& chain) {
  if (!chain.is_array()) return "";
  std::string text;
  for (const json& one : chain) {
    const std::string state = text_or(one, "state", "");
    if (state != "blocks" && state != "warns") continue;
    const std::string remedy = text_or(one, "remedy", "");
    text += line(text.empty() ? "In the way" : "",
                 fmt::format("{}{}: {}{}{}", text_or(one, "name", ""), state == "blocks" ? "" : " (later)",
                             text_or(one, "sentence", ""), remedy.empty() ? "" : ". ", remedy));
  }
  return text.empty() ? line("In the way", "nothing that this program knows of") : text;
}

}  // namespace

std::string render_status(const json& status) {
  std::string text = text_or(status, "state", "unknown") + "\n";
  std::string reason = text_or(status, "reason", "");
  if (reason.empty()) reason = what_next(text_or(status, "state", ""));
  if (!reason.empty()) text += "  " + reason + "\n";
  text += "\n";
  const json& job = member(status, "job");
  text += line("Job", job.is_object() ? job_words(job) : "none");
  if (const auto pieces = whole_or(job, "pieces", 0); pieces > 0) {
    text += line("", progress_line(static_cast<double>(whole_or(job, "cut", 0)) / static_cast<double>(pieces), "", 40));
  }
  const std::string next = text_or(status, "next", "");
  text += line("Next", next.empty() ? next_step_words(member(status, "next_step")) : next);
  const json& load = member(status, "load");
  if (load.is_object())
    text += line("On the bed", load_words(load)) + before_motion_words(load, member(status, "confirm"));
  if (const json& recut = member(status, "recut"); recut.is_object())
    text += line("Recut", fmt::format("{} pieces of {} can be cut again while it lies unmoved",
                                      whole_or(recut, "pieces", 0), text_or(recut, "panel", "?")));
  if (const json& open = member(status, "open_scan"); open.is_object()) text += line("Scan", open_scan_words(open));
  if (const json& kept = member(status, "kept_scan"); kept.is_object())
    text += line("Scan", fmt::format("a series of {0} tiles was refused at {1} and is kept for a day: scan the bad one "
                                     "anew, the last one by veneerctl panel scan --again {0}",
                                     whole_or(kept, "tiles", 0), text_or(kept, "since", "?")));
  text += line("Owed", text_or(member(status, "owed_look"), "sentence", ""));
  const json& laser = member(status, "laser");
  text += line("Laser", laser_words(laser));
  text += line("", text_or(laser, "refusal", ""));
  const std::string turned = overrides_words(member(laser, "overrides_wanted"));
  text += line("Overrides", turned.empty() ? "" : turned + " of what the job asks for");
  text += line("Lid", lid_words(text_or(status, "lid", ""), flag_or(laser, "connected", false)));
  text += line("Stock", stock_words(status));
  text += line("Calibration", calibration_words(member(status, "calibration")));
  text += interlock_lines(member(status, "interlocks"));
  const json& tasks = member(status, "tasks");
  if (tasks.is_array()) {
    for (const json& task : tasks) {
      if (text_or(task, "state", "") == "running") text += line("Task", render_task(task).substr(0, 200));
    }
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

std::string render_next(const json& status) {
  const json& step = member(status, "next_step");
  const std::string command = text_or(step, "command", "");
  return text_or(step, "sentence", "The cell does not say what comes next.") + "\n" +
         (command.empty() ? "" : "  " + command + "\n");
}

namespace {

// What a certificate does not tell, or will not for long.
std::string doubt_lines(const json& certificate, const std::string& of) {
  std::string text;
  if (const json& doubts = member(certificate, "doubts"); doubts.is_array())
    for (const json& doubt : doubts)
      if (doubt.is_string()) text += line(of, doubt.get<std::string>());
  return text;
}

// How much of the glass or the bed was measured; "" where a certificate does not say.
std::string share_measured(const json& certificate) {
  if (!member(certificate, "measured_fraction").is_number()) return "";
  return fmt::format("{:.0f} %", 100 * number_or(certificate, "measured_fraction", 0));
}

}  // namespace

std::string render_certificate(const json& reply) {
  std::string text = render_certificates({{"certificates", json::array({member(reply, "certificate")})}});
  const json& at = member(reply, "at");
  if (!at.is_object()) return text;
  const std::string frame = text_or(at, "frame", "");
  const std::string place = fmt::format("{:g}, {:g} mm{}", number_or(at, "x_mm", 0), number_or(at, "y_mm", 0),
                                        frame == "scan"  ? " right and down from the upper left corner of a scan"
                                        : frame == "bed" ? " right and away from the machine's origin"
                                                         : "");
  if (!member(at, "predicted_error_mm").is_number())
    return text + line("At", place) +
           line("Predicted error", "none: " + text_or(at, "not_predicted", "it is not told"));
  return text + line("At", place) +
         line("Predicted error", fmt::format("{:.3f} mm, one sigma; twice as much is seldom exceeded",
                                             number_or(at, "predicted_error_mm", 0))) +
         line("Measured",
              fmt::format("about {:.0f} mm from there, the nearest place", number_or(at, "to_measured_mm", 0)));
}

std::string render_certificates(const json& reply) {
  const json& list = member(reply, "certificates");
  if (!list.is_array() || list.empty()) return "No certificates yet. Begin with `veneerctl calibrate scanner`.\n";
  TextTable table({">NO", "OF", "STATE", ">RMS", ">WORST", ">MEASURED", ">PREDICTED", "ISSUED", "EXPIRES", "MADE ON"});
  for (const json& certificate : list) {
    table.add({std::to_string(whole_or(certificate, "id", 0)), text_or(certificate, "device", ""),
               state_words(text_or(certificate, "state", "")), millimetres(certificate, "rms_mm", 3),
               millimetres(certificate, "max_mm", 3), share_measured(certificate),
               millimetres(certificate, "worst_predicted_mm", 3), text_or(certificate, "issued", ""),
               text_or(certificate, "expires", ""), text_or(certificate, "made_on", "")});
  }
  std::string text = table.str();
  for (const json& certificate : list)
    text += doubt_lines(certificate, fmt::format("No. {}", whole_or(certificate, "id", 0)));
  return text;
}

std::string render_recipes(const json& reply) {
  const json& list = member(reply, "recipes");
  if (!list.is_array() || list.empty())
    return "No recipes yet; all wood is burnt as the configuration says. Begin with `veneerctl recipe card`.\n";
  TextTable table({"MATERIAL", "OPERATION", ">SPEED", ">POWER", ">PASSES", "AIR", ">KERF BACK", ">KERF SHOW"});
  for (const json& recipe : list) {
    table.add({text_or(recipe, "material", ""), text_or(recipe, "operation", ""),
               fmt::format("{:g} mm/s", number_or(recipe, "speed_mm_s", 0)),
               fmt::format("{:.0f} %", 100 * number_or(recipe, "power", 0)),
               std::to_string(whole_or(recipe, "passes", 1)), flag_or(recipe, "air", true) ? "on" : "off",
               millimetres(recipe, "kerf_back_mm", 2), millimetres(recipe, "kerf_show_mm", 2)});
  }
  return table.str();
}

std::string render_task(const json& task) {
  std::string text =
      fmt::format("{} {} {}", whole_or(task, "id", 0), text_or(task, "kind", ""), text_or(task, "state", ""));
  if (text_or(task, "state", "") == "running") text += fmt::format(" {:.0f} %", 100 * number_or(task, "progress", 0));
  const std::string why = text_or(member(task, "error"), "message", text_or(task, "text", ""));
  return text + (why.empty() ? "" : ": " + why);
}

std::string render_tasks(const json& reply) {
  const json& tasks = member(reply, "tasks");
  if (!tasks.is_array() || tasks.empty()) return "No tasks.\n";
  std::string text;
  for (const json& task : tasks) text += render_task(task) + "\n";
  return text;
}

std::string render_state(const json& taken) {
  std::string text = text_or(taken, "state", "");
  if (const std::string reason = text_or(taken, "reason", ""); !reason.empty()) text += ": " + reason;
  return text.empty() ? "" : text + "\n";
}

std::string render_twin(const json& status) {
  std::string text;
  const json& sheets = member(status, "sheets");
  TextTable table({"SHEET", "KIND", "WHERE", "FACE UP"});
  if (sheets.is_array()) {
    for (const json& sheet : sheets) {
      table.add({text_or(sheet, "name", "?"), text_or(sheet, "kind", ""), text_or(sheet, "where", ""),
                 text_or(sheet, "face_up", "")});
    }
  }
  text += table.str();
  json rest = status.is_object() ? status : json::object();
  for (const char* shown : {"sheets", "ok", "schema_version"}) rest.erase(shown);
  return text + render_plain(rest);
}

std::string render_calibration(const json& result) {
  const json& figures = member(result, "figures");
  const std::string device = text_or(result, "device", "");
  std::string text = "Calibrated " + device + "\n";
  if (whole_or(result, "certificate", 0) == 0) {
    text = fmt::format("Picture {} taken. Go on with the next; leave --more out for the last one.\n",
                       whole_or(result, "views", 0));
    return text;
  }
  text += line("Certificate", std::to_string(whole_or(result, "certificate", 0)));
  text += line("Pictures", std::to_string(whole_or(result, "views", 0)));
  text +=
      line("Fit", joined({"RMS " + millimetres(result, "rms_mm", 3),
                          member(figures, "max_mm").is_number() ? "worst " + millimetres(figures, "max_mm", 3) : ""},
                         ", "));
  text += line("Kerf", millimetres(figures, "kerf_mm", 3));
  if (const std::string share = share_measured(figures); !share.empty())
    text += line("Measured", share + (device == "scanner" ? " of the glass" : " of the bed that the beam reaches"));
  if (const std::string worst = millimetres(figures, "worst_predicted_mm", 3); !worst.empty())
    text += line("Predicted", worst + " at worst, one sigma");
  text += doubt_lines(result, "Beware");
  return text;
}

std::string render_plain(const json& result) {
  if (!result.is_object()) return result.is_null() ? "" : result.dump() + "\n";
  std::string text;
  for (const auto& [key, value] : result.items()) {
    if (key == "ok" || key == "schema_version") continue;
    if (value.is_object()) {
      std::vector<std::string> parts;
      for (const auto& [name, inner] : value.items()) {
        if (!inner.is_structured())
          parts.push_back(name + " " + (inner.is_string() ? inner.get<std::string>() : inner.dump()));
      }
      text += line(key, joined(parts, ", "));
    } else if (value.is_array() && value.size() > 16) {
      text += line(key, fmt::format("{} values", value.size()));
    } else {
      text += line(key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
  return text;
}

}  // namespace veneer::cli
