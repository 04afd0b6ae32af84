#include "cli/render.h"

#include <fmt/format.h>

#include <vector>

#include "cli/json_read.h"
#include "cli/progress.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

// What the cell does with it is newer than what the ledger says, which follows with the first piece.
std::string state_of(const json& job) {
  return text_or(job, "now", text_or(job, "state", "")) + (flag_or(job, "archived", false) ? ", archived" : "");
}

}  // namespace

std::string render_jobs(const json& reply) {
  const json& jobs = member(reply, "jobs");
  if (!jobs.is_array() || jobs.empty())
    return "No jobs here. `veneerctl job new PICTURE` plans one, `veneerctl job list --all` shows archived ones too.\n";
  TextTable table({">JOB", ">QUEUE", "NAME", "STATE", ">PIECES", ">CUT", ">SUSPECT", "CREATED"});
  for (const json& job : jobs) {
    const json& place = member(job, "queue_place");
    table.add({std::to_string(whole_or(job, "id", 0)), place.is_number_integer() ? place.dump() : "",
               text_or(job, "name", ""), state_of(job), std::to_string(whole_or(job, "pieces", 0)),
               std::to_string(whole_or(job, "cut", 0)), std::to_string(whole_or(job, "suspect", 0)),
               text_or(job, "created", "")});
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

// "A1 on P-0001: the last scan shows wood there"
std::string suspect_words(const json& piece) {
  return joined(
      {fmt::format("{} on {}", text_or(piece, "mark", "?"), text_or(piece, "panel", "?")), sighting_words(piece)},
      ": ");
}

}  // namespace

std::string render_job(const json& job) {
  const auto pieces = whole_or(job, "pieces", 0);
  const auto cut = whole_or(job, "cut", 0);
  std::string text = fmt::format("Job {} \"{}\"\n", whole_or(job, "id", 0), text_or(job, "name", ""));
  text += line("State", state_of(job));
  if (pieces > 0) {
    text += line("Cut", progress_line(static_cast<double>(cut) / static_cast<double>(pieces),
                                      fmt::format("{} of {} pieces", cut, pieces), 80));
  }
  if (const auto suspect = whole_or(job, "suspect", 0); suspect > 0) {
    text += line("Suspect", fmt::format("{}: look at these pieces before you use them", suspect));
    if (const json& list = member(job, "suspects"); list.is_array())
      for (const json& piece : list) text += line("", suspect_words(piece));
  }
  if (const auto laid = whole_or(job, "assembled", 0); laid > 0)
    text += line("Assembled", fmt::format("{} of {} pieces", laid, whole_or(job, "pieces", 0)));
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

std::string render_suspects(const json& job) {
  const auto id = whole_or(job, "id", 0);
  const json& list = member(job, "suspects");
  if (!list.is_array() || list.empty()) return fmt::format("No piece of job {} is suspect.\n", id);
  std::string text;
  bool seen = false;
  for (const json& piece : list) {
    text += suspect_words(piece) + "\n";
    const std::string what = text_or(member(piece, "sighting"), "seen", "");
    seen = seen || what == "cut";
  }
  const std::string first = text_or(list.front(), "mark", "?");
  return text +
         fmt::format(
             "Look at {}, and say what became of it: `veneerctl job settle {} {} cut` when it is good, "
             "`scrap` when it is lost, `released` when its wood is whole.\n",
             list.size() == 1 ? "it" : "each", id, first) +
         (seen ? fmt::format(
                     "`veneerctl job settle {} --as-seen` says of all that the last scan saw gone that they are cut.\n",
                     id)
               : "");
}

std::string render_settled_as_seen(const json& settled) {
  std::string text;
  for (const auto& [list, words] :
       {std::pair("cut", "Cut"), std::pair("scrap", "Lost"), std::pair("released", "Released, their wood is free"),
        std::pair("left", "Still suspect, look at each")})
    if (const json& marks = member(settled, list); marks.is_array() && !marks.empty())
      text += fmt::format("{}: {}.\n", words, names_of(marks));
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

std::string render_advice(const json& reply) {
  TextTable table({">NO.", ">SIZE", "LAYOUT", ">PIECES", ">MISSING", ">LIKENESS", ">TO CUT", "OPTIONS"});
  const json& list = member(reply, "suggestions");
  std::int64_t number = 0;
  if (list.is_array())
    for (const json& it : list) {
      const std::string crop = text_or(it, "crop", "");
      table.add({fmt::format("{}{}", ++number == whole_or(reply, "suggested", 0) ? "* " : "", number),
                 fmt::format("{:.0f} x {:.0f} mm", number_or(it, "width_mm", 0), number_or(it, "height_mm", 0)),
                 text_or(it, "layout", ""), std::to_string(whole_or(it, "pieces", 0)),
                 std::to_string(whole_or(it, "unfilled", 0)), fmt::format("{:.2f}", number_or(it, "likeness", 0)),
                 duration_words(number_or(it, "cutting_s", 0)),
                 fmt::format("--layout {} --size-mm {:.6g} --patch-mm {:.6g}{}", text_or(it, "layout", ""),
                             number_or(it, "size_mm", 0), number_or(it, "patch_mm", 0),
                             crop.empty() ? "" : " --crop " + crop)});
    }
  std::string out = table.str();
  if (const json& remarks = member(reply, "remarks"); remarks.is_array())
    for (const json& remark : remarks)
      if (remark.is_string()) out += remark.get<std::string>() + "\n";
  return out +
         "The one with * is suggested. Nothing is kept or reserved: `veneerctl job plan` or `job new` with its "
         "options plans it.\n";
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
  if (member(plan, "segmentation").is_string())
    text += line("Drawing",
                 fmt::format("kept: `veneerctl job plans {} --segmentation FILE` saves it", whole_or(plan, "id", 0)));
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
               joined({text_or(piece, "state", ""), sighting_words(piece)}, ": ")});
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

}  // namespace veneer::cli
