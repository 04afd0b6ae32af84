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
  if (!flag_or(laser, "homed", false)) return "not homed";
  return flag_or(laser, "finds_home", true) ? "homed" : "no homing switches: counts from the corner it was given";
}

std::string laser_words(const json& laser) {
  if (!flag_or(laser, "connected", false)) {
    const std::string why = text_or(laser, "why_not_connected", "");
    return why.empty() ? "not connected yet: `veneerctl reset` connects and homes it" : "NOT CONNECTED: " + why;
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
  if (text_or(laser, "controller", "") == "test") parts.emplace_back("a test controller, no laser");
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

std::string kind_words(const std::string& kind) {
  if (kind == "gone_not_booked") return "wood is gone that is not booked as cut";
  if (kind == "booked_not_gone") return "booked as cut, and still in the panel";
  return kind;
}

std::string difference_words(const json& difference) {
  const json& place = member(difference, "place_mm");
  std::string where;
  if (place.is_array() && place.size() == 2 && place[0].is_number() && place[1].is_number()) {
    where = fmt::format("at {:.1f}, {:.1f} mm", place[0].get<double>(), place[1].get<double>());
  }
  std::vector<std::string> words = {kind_words(text_or(difference, "kind", "?")), where,
                                    fmt::format("{:.1f} mm2", number_or(difference, "area_mm2", 0))};
  if (const json& pieces = member(difference, "pieces"); pieces.is_array())
    for (const json& piece : pieces)
      words.push_back(fmt::format("piece {} of job {:.0f}, {}", text_or(piece, "mark", "?"), number_or(piece, "job", 0),
                                  text_or(piece, "state", "?")));
  return joined(words, ", ");
}

// A line for what nobody has decided on yet; "" when there is nothing.
std::string open_differences_words(const json& panel) {
  const auto open = whole_or(panel, "open_differences", 0);
  if (open == 0) return "";
  const std::string id = text_or(panel, "id", "?");
  return fmt::format("{}: wood and ledger disagree in {}: `veneerctl panel differences {}`\n", id,
                     open == 1 ? "1 place" : fmt::format("{} places", open), id);
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
  return lid == "unknown" && connected ? "not known: no lid switch is wired to the laser's controller" : lid;
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

// What the cell warns of, a line each.
std::string warning_lines(const json& result) {
  std::string text;
  for (const json& warning : member(result, "warnings"))
    if (warning.is_string()) text += fmt::format("Warning: {}\n", warning.get<std::string>());
  return text;
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
  text += line("Next", text_or(status, "next", ""));
  const json& load = member(status, "load");
  if (load.is_object())
    text += line("On the bed", load_words(load)) + before_motion_words(load, member(status, "confirm"));
  if (const json& recut = member(status, "recut"); recut.is_object())
    text += line("Recut", fmt::format("{} pieces of {} can be cut again while it lies unmoved",
                                      whole_or(recut, "pieces", 0), text_or(recut, "panel", "?")));
  const json& laser = member(status, "laser");
  text += line("Laser", laser_words(laser));
  text += line("", text_or(laser, "refusal", ""));
  const std::string turned = overrides_words(member(laser, "overrides_wanted"));
  text += line("Overrides", turned.empty() ? "" : turned + " of what the job asks for");
  text += line("Lid", lid_words(text_or(status, "lid", ""), flag_or(laser, "connected", false)));
  text += line("Stock",
               fmt::format("{} panel{}", whole_or(status, "panels", 0), whole_or(status, "panels", 0) == 1 ? "" : "s"));
  text += line("Calibration", calibration_words(member(status, "calibration")));
  const json& tasks = member(status, "tasks");
  if (tasks.is_array()) {
    for (const json& task : tasks) {
      if (text_or(task, "state", "") == "running") text += line("Task", render_task(task).substr(0, 200));
    }
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

std::string render_panels(const json& reply) {
  const json& panels = member(reply, "panels");
  if (!panels.is_array() || panels.empty())
    return whole_or(reply, "retired_left_out", 0) > 0
               ? "No panels in stock: all were retired. `veneerctl panel list --all` shows them.\n"
               : "No panels yet. Lay one on the scanner and run `veneerctl panel scan`.\n";
  TextTable table({"PANEL", ">SIZE", ">FREE", ">RESERVED", ">CUT", "FACES", ">FIT", "FROM"});
  std::string retired;
  for (const json& panel : panels) {
    table.add({text_or(panel, "id", "?"), size_of(panel), square_cm(panel, "free_mm2"),
               square_cm(panel, "reserved_mm2"), square_cm(panel, "cut_mm2"), names_of(member(panel, "faces")),
               millimetres(panel, "rms_mm", 3), text_or(panel, "parent", "")});
    if (const json& why = member(panel, "retired"); why.is_object())
      retired += fmt::format("{} is retired: {}\n", text_or(panel, "id", "?"), text_or(why, "reason", "?"));
    retired += open_differences_words(panel);
  }
  return table.str() + retired;
}

std::string render_panel(const json& panel) {
  std::string text = "Panel " + text_or(panel, "id", "?") + "\n";
  text += line("Name", text_or(panel, "name", ""));
  text += line("Size", size_of(panel));
  if (const json& book = member(panel, "area_book_mm2"); book.is_object()) {
    text += line("Area", square_cm(book, "panel"));
    text += line("Free", square_cm(book, "free"));
    text += line("Reserved", square_cm(book, "reserved"));
    text += line("Cut", square_cm(book, "cut"));
    text += line("Kerf", square_cm(book, "kerf"));
    text += line("Suspect", square_cm(book, "suspect"));
    text += line("Scrap", square_cm(book, "scrap"));
    text += line("Unusable", square_cm(book, "unusable"));
  } else {
    text += line("Usable", square_cm(panel, "usable_mm2"));
    text += line("Free", square_cm(panel, "free_mm2"));
    text += line("Reserved", square_cm(panel, "reserved_mm2"));
    text += line("Cut", square_cm(panel, "cut_mm2"));
  }
  text += render_remnant(panel);
  text += line("Faces", names_of(member(panel, "faces")));
  text += line("Fit", millimetres(panel, "rms_mm", 3));
  text += line("Remnant of", text_or(panel, "parent", ""));
  text += line("Parts", names_of(member(panel, "parts")));
  text += line("Since", text_or(panel, "created", ""));
  if (const json& why = member(panel, "retired"); why.is_object())
    text += line("Retired", text_or(why, "reason", "?") + ", " + text_or(why, "at", ""));
  return text + render_facts(panel) + open_differences_words(panel) + render_zones(panel);
}

std::string render_masks(const json& masks) {
  TextTable table({">VERSION", "MADE", ">USABLE", "WHAT"});
  const json& versions = member(masks, "versions");
  if (!versions.is_array()) return "";
  for (const json& version : versions) {
    const json& same = member(version, "same_as");
    table.add({std::to_string(version.value("version", 0)), text_or(version, "made", ""),
               square_cm(version, "usable_mm2"),
               joined({&version == &versions.front() ? "counts" : "",
                       same.is_number() ? fmt::format("version {} again", same.get<int>()) : ""},
                      ", ")});
  }
  return table.str();
}

std::string render_reverted(const json& reply) {
  return fmt::format(
      "Panel {}: version {} counts now, with {} of usable wood. `veneerctl panel scans {}` lists them.\n",
      text_or(reply, "panel", "?"), reply.value("version", 0), square_cm(reply, "usable_mm2"),
      text_or(reply, "panel", "?"));
}

std::string render_retired(const json& reply) {
  const std::string panel = text_or(reply, "panel", "?");
  if (member(reply, "sawn") == json(true))
    return fmt::format("Panel {} is out of stock. Scan each of its parts: `veneerctl panel scan`.\n", panel);
  if (member(reply, "retired") == json(true))
    return fmt::format("Panel {} is out of stock. `veneerctl panel restore {}` puts it back.\n", panel, panel);
  return fmt::format("Panel {} is in stock.\n", panel);
}

std::string render_differences(const json& reply) {
  const json& differences = member(reply, "differences");
  const std::string panel = text_or(reply, "panel", "?");
  std::string open, decided;
  int accepted = 0;
  if (!differences.is_array()) return "";
  for (const json& difference : differences) {
    const std::string words = fmt::format("{:>4}  {}", whole_or(difference, "id", 0), difference_words(difference));
    const json& decision = member(difference, "decided");
    if (!decision.is_object()) {
      open += words + "\n";
      continue;
    }
    std::string verdict = text_or(decision, "verdict", "?");
    accepted += verdict == "accepted" ? 1 : 0;
    std::replace(verdict.begin(), verdict.end(), '_', ' ');
    decided += fmt::format("{}: {}\n", words,
                           joined({verdict, text_or(decision, "who", ""), text_or(decision, "note", "")}, ", "));
  }
  // Only a decision answers so: pieces that were to be cut from wood that was just written off.
  const json& suspect = member(reply, "suspect");
  if (suspect.is_array())
    for (const json& piece : suspect) {
      const std::string named = fmt::format("{} {}", whole_or(piece, "job", 0), text_or(piece, "mark", "?"));
      decided += fmt::format(
          "The wood of piece {0} of job {1} lies there: it is suspect. Say that it is lost with `veneerctl job settle "
          "{2} scrap`, then `veneerctl job redo {2}` finds other wood.\n",
          text_or(piece, "mark", "?"), whole_or(piece, "job", 0), named);
    }
  if (open.empty() && accepted > 0)
    return decided + fmt::format("Nothing is open on {}; {} accepted.\n", panel, accepted);
  if (open.empty()) return decided + fmt::format("Nothing is open: the ledger agrees with the wood of {}.\n", panel);
  return decided + fmt::format(
                       "Open:\n{}`veneerctl panel decide {} NUMBER written-off` books wood that is gone as scrap, "
                       "`... accepted` leaves things as they are.\n",
                       open, panel);
}

std::string render_registration(const json& registration) {
  return line("Registered", joined({"RMS " + millimetres(registration, "rms_mm", 3),
                                    "worst " + millimetres(registration, "max_mm", 3)},
                                   ", "));
}

std::string render_scan_result(const json& result) {
  std::string text;
  const std::string panel = text_or(result, "panel", "");
  if (panel.empty())
    return "Scanned. Lay the next part on the glass and scan again; leave --more out for the last one.\n";
  text += "Panel " + panel + "\n";
  if (const std::string parent = text_or(result, "part_of", ""); !parent.empty())
    text += line("Part of",
                 fmt::format("{}, with {} places where its wood was gone", parent, whole_or(result, "carried", 0)));
  const json& registration = member(result, "registration");
  if (registration.is_object() && member(registration, "rms_mm").is_number()) text += render_registration(registration);
  const json& differences = member(result, "differences");
  if (differences.is_array()) {
    text += line("Ledger", differences.empty() ? "agrees with the wood"
                                               : fmt::format("{} DIFFERENCES from the wood", differences.size()));
    for (const json& difference : differences) {
      text += line("", difference_words(difference));
    }
  }
  return text + warning_lines(result);
}

std::string render_certificates(const json& reply) {
  const json& list = member(reply, "certificates");
  if (!list.is_array() || list.empty()) return "No certificates yet. Begin with `veneerctl calibrate scanner`.\n";
  TextTable table({">NO", "OF", "STATE", ">RMS", ">WORST", "ISSUED", "EXPIRES", "MADE ON"});
  for (const json& certificate : list) {
    table.add({std::to_string(whole_or(certificate, "id", 0)), text_or(certificate, "device", ""),
               state_words(text_or(certificate, "state", "")), millimetres(certificate, "rms_mm", 3),
               millimetres(certificate, "max_mm", 3), text_or(certificate, "issued", ""),
               text_or(certificate, "expires", ""), text_or(certificate, "made_on", "")});
  }
  return table.str();
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

std::string render_zones(const json& panel) {
  const json& list = member(panel, "zones");
  if (!list.is_array() || list.empty()) return "";
  TextTable table({">ZONE", "MATERIAL", ">AREA"});
  for (const json& zone : list)
    table.add({std::to_string(whole_or(zone, "zone", 0)), text_or(zone, "material", "not named"),
               square_cm(zone, "area_mm2")});
  return table.str();
}

std::string render_jobs(const json& reply) {
  const json& jobs = member(reply, "jobs");
  if (!jobs.is_array() || jobs.empty()) return "No jobs yet. Plan one with `veneerctl job new PICTURE`.\n";
  TextTable table({">JOB", "NAME", "STATE", ">PIECES", ">CUT", ">SUSPECT", "CREATED"});
  for (const json& job : jobs) {
    table.add({std::to_string(whole_or(job, "id", 0)), text_or(job, "name", ""),
               text_or(job, "now", text_or(job, "state", "")) + (flag_or(job, "archived", false) ? ", archived" : ""),
               std::to_string(whole_or(job, "pieces", 0)), std::to_string(whole_or(job, "cut", 0)),
               std::to_string(whole_or(job, "suspect", 0)), text_or(job, "created", "")});
  }
  return table.str();
}

namespace {

// "cost 12.30 instead of 15.10 (18.5 % less)"
std::string gain_of(double before, double after) {
  return fmt::format("cost {:.2f} instead of {:.2f} ({:.1f} % less)", after, before,
                     before > 0 ? 100 * (1 - after / before) : 0.0);
}

// "follow the picture: cost 12.30 instead of 15.10 (18.5 % less), wood chosen again 2 times"; "" of straight borders.
std::string refined_words(const json& refined) {
  if (!refined.is_object()) return "";
  const auto rounds = whole_or(refined, "rounds", 0);
  return fmt::format("follow the picture: {}{}",
                     gain_of(number_or(refined, "cost_before", 0), number_or(refined, "cost", 0)),
                     rounds == 1  ? ", wood chosen again once"
                     : rounds > 1 ? fmt::format(", wood chosen again {} times", rounds)
                                  : "");
}

}  // namespace

std::string render_job(const json& job) {
  const auto pieces = whole_or(job, "pieces", 0);
  const auto cut = whole_or(job, "cut", 0);
  std::string text = fmt::format("Job {} \"{}\"\n", whole_or(job, "id", 0), text_or(job, "name", ""));
  text += line("State", text_or(job, "state", "") + (flag_or(job, "archived", false) ? ", archived" : ""));
  text += line("Now", text_or(job, "now", ""));
  if (pieces > 0) {
    text += line("Cut", progress_line(static_cast<double>(cut) / static_cast<double>(pieces),
                                      fmt::format("{} of {} pieces", cut, pieces), 80));
  }
  if (const auto suspect = whole_or(job, "suspect", 0); suspect > 0) {
    text += line("Suspect", fmt::format("{}: look at these pieces before you use them", suspect));
  }
  if (const auto missing = whole_or(job, "missing", 0); missing > 0)
    text += line("Missing", fmt::format("{0} piece{1}: `veneerctl job redo {2}` finds other wood for {3}", missing,
                                        missing == 1 ? "" : "s", whole_or(job, "id", 0), missing == 1 ? "it" : "them"));
  text += line("Next", text_or(job, "next", ""));
  const json& options = member(job, "options");
  text += line(
      "Picture",
      joined({size_of(job), options.contains("patch_mm") ? "patches of " + millimetres(options, "patch_mm", 1) : ""},
             ", "));
  text += line("Borders", refined_words(member(job, "refined")));
  text += line("Created", text_or(job, "created", ""));
  const json& panels = member(job, "panels");
  if (panels.is_array() && !panels.empty()) {
    TextTable table({"  PANEL", ">PIECES", ">CUT"});
    for (const json& panel : panels) {
      table.add({"  " + text_or(panel, "panel", "?"), std::to_string(whole_or(panel, "pieces", 0)),
                 std::to_string(whole_or(panel, "cut", 0))});
    }
    text += table.str();
  }
  return text;
}

namespace {

std::string pieces_words(const json& result) {
  const auto pieces = whole_or(result, "pieces", 0);
  return pieces > 0 ? fmt::format(" ({} pieces)", pieces) : "";
}

// What planning gained, and what it warns of.
std::string outcome_words(const json& result) {
  std::string text;
  if (const auto edge = whole_or(result, "without_lead_in", 0); edge > 0)
    text +=
        fmt::format("{} of its pieces lie too close to others for a lead-in: their cuts begin on their edges.\n", edge);
  if (const json& global = member(result, "global"); global.is_object()) {
    const auto open = whole_or(global, "greedy_unfilled", 0);
    text += fmt::format("Choosing together: {}{}.\n",
                        open > 0 ? fmt::format("{} patches have wood that would have had none", open)
                                 : gain_of(number_or(global, "greedy_cost", 0), number_or(global, "cost", 0)),
                        flag_or(global, "stopped", false)
                            ? fmt::format(", stopped after {} of {} iterations", whole_or(global, "iterations", 0),
                                          whole_or(global, "budget", 0))
                            : "");
  }
  if (const json& fine = member(result, "fine_rotation"); fine.is_object())
    text += fmt::format("{} pieces turned finely: {}.\n", whole_or(fine, "moved", 0),
                        gain_of(number_or(fine, "cost_before", 0), number_or(fine, "cost", 0)));
  if (const std::string refined = refined_words(member(result, "refined")); !refined.empty())
    text += fmt::format("Borders {}.\n", refined);
  return text + warning_lines(result);
}

}  // namespace

std::string render_new_job(const json& result) {
  const auto id = whole_or(result, "job", 0);
  return fmt::format("Job {}{} is planned and its wood reserved. Start it with `veneerctl job start {}`.\n", id,
                     pieces_words(result), id) +
         outcome_words(result);
}

std::string render_redone(const json& result) {
  const auto id = whole_or(result, "job", 0);
  const json& redone = member(result, "redone");
  TextTable table({"PIECE", ">COST BEFORE", ">COST NOW"});
  if (redone.is_array())
    for (const json& piece : redone) {
      const json& before = member(piece, "cost_before");
      table.add({text_or(piece, "mark", "?"), before.is_number() ? fmt::format("{:.5f}", before.get<double>()) : "none",
                 fmt::format("{:.5f}", number_or(piece, "cost", 0))});
    }
  const double before = number_or(result, "cost_per_pixel_before", 0), now = number_or(result, "cost_per_pixel", 0);
  const std::string change = before > 0 ? fmt::format(" ({:+.2f} %)", 100 * (now / before - 1)) : "";
  return fmt::format(
             "{0}The whole picture costs {1:.6f} per pixel after {2:.6f}{3}. The wood is reserved: see the picture "
             "with "
             "`veneerctl job show {4} --preview FILE`, cut the pieces with `veneerctl job start {4}`. "
             "(`veneerctl job cancel {4}` would give up all that the job has not cut yet.)\n",
             table.str(), now, before, change, id) +
         outcome_words(result);
}

std::string render_new_plan(const json& result) {
  const auto id = whole_or(result, "plan", 0);
  return fmt::format(
             "Plan {0}{1} is kept, and no wood is reserved. `veneerctl job plans {0} --preview FILE` shows it, "
             "`veneerctl "
             "job change {0}` plans it otherwise, `veneerctl job lease {0}` keeps its wood for it, `veneerctl job new "
             "--plan {0}` makes a job of it.\n",
             id, pieces_words(result)) +
         outcome_words(result);
}

std::string render_plans(const json& reply) {
  const json& plans = member(reply, "plans");
  if (!plans.is_array() || plans.empty()) return "No plans yet. Make one with `veneerctl job plan PICTURE`.\n";
  TextTable table({">PLAN", "NAME", ">OF", ">PIECES", ">PLACED", ">COST", "JOBS", "LEASED UNTIL", "CREATED"});
  for (const json& plan : plans) {
    const json& parent = member(plan, "parent");
    const json& cost = member(member(plan, "report"), "cost_per_pixel");
    table.add({std::to_string(whole_or(plan, "id", 0)), text_or(plan, "name", ""),
               parent.is_number_integer() ? parent.dump() : "", std::to_string(whole_or(plan, "pieces", 0)),
               std::to_string(whole_or(plan, "placed", 0)),
               cost.is_number() ? fmt::format("{:.5f}", cost.get<double>()) : "", names_of(member(plan, "jobs")),
               moment_words(text_or(member(plan, "lease"), "until", "")), text_or(plan, "created", "")});
  }
  return table.str();
}

std::string render_plan(const json& plan) {
  std::string text = fmt::format("Plan {} \"{}\"\n", whole_or(plan, "id", 0), text_or(plan, "name", ""));
  const json& report = member(plan, "report");
  if (const json& parent = member(plan, "parent"); parent.is_number_integer())
    text += line("Changes", "plan " + parent.dump());
  text +=
      line("Pieces", fmt::format("{}, {} of them placed", whole_or(plan, "pieces", 0), whole_or(plan, "placed", 0)));
  if (const json& cost = member(report, "cost_per_pixel"); cost.is_number())
    text += line("Cost", fmt::format("{:.5f} per pixel", cost.get<double>()));
  std::vector<std::string> panels;
  if (const json& list = member(plan, "panels"); list.is_array())
    for (const json& panel : list) panels.push_back(text_or(panel, "panel", "?"));
  text += line("Panels", joined(panels, ", "));
  if (const std::string outdated = names_of(member(plan, "outdated_panels")); !outdated.empty())
    text += line("Outdated", outdated + ": scanned again since, so no job can be made of it; plan again");
  if (const json& lease = member(plan, "lease"); lease.is_object())
    text += line("Leased", fmt::format("its wood is kept until {} for {}", moment_words(text_or(lease, "until", "?")),
                                       text_or(lease, "who", "?")));
  text += line("Jobs", names_of(member(plan, "jobs")));
  text += line("Created", text_or(plan, "created", ""));
  text += line("Asked by", text_or(plan, "asked_by", ""));
  return text + outcome_words(report);
}

std::string render_pieces(const json& reply) {
  TextTable table({">ID", "MARK", "PANEL", "STATE"});
  const json& pieces = member(reply, "pieces");
  if (!pieces.is_array()) return "";
  for (const json& piece : pieces) {
    table.add({std::to_string(whole_or(piece, "id", 0)), text_or(piece, "mark", ""), text_or(piece, "panel", ""),
               text_or(piece, "state", "")});
  }
  return table.str();
}

std::string render_ledger(const json& reply) {
  TextTable table({">PIECE", "MARK", ">JOB", ">AREA", "STATE"});
  const json& allocations = member(reply, "allocations");
  if (!allocations.is_array()) return "";
  for (const json& allocation : allocations) {
    table.add({std::to_string(whole_or(allocation, "piece", 0)), text_or(allocation, "mark", ""),
               std::to_string(whole_or(allocation, "job", 0)),
               fmt::format("{:.1f} mm2", number_or(allocation, "area_mm2", 0)), text_or(allocation, "state", "")});
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
  std::string text = "Calibrated " + text_or(result, "device", "") + "\n";
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
