// Scans, what they propose, and what is painted on masks, as text.
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string size_words(const json& seen) {
  const json& size = member(seen, "size_mm");
  if (!size.is_array() || size.size() != 2 || !size[0].is_number() || !size[1].is_number()) return "";
  return fmt::format("{:.1f} x {:.1f} mm", size[0].get<double>(), size[1].get<double>());
}

// " --override strip-1 --override size"; "" without warnings.
std::string overrides(const json& seen) {
  std::string out;
  for (const json& warning : member(seen, "warnings")) out += " --override " + text_or(warning, "name", "?");
  return out;
}

// What is to be done about a scan that waits.
std::string next_steps(const json& seen, std::int64_t number) {
  const std::string how = overrides(seen);
  std::string text;
  if (how.empty())
    text = fmt::format("Not in stock yet. Take it: `veneerctl panel accept {}`\n", number);
  else
    text = fmt::format(
        "Not in stock yet, for it has warnings. If it is right all the same: `veneerctl panel accept "
        "{}{}`\n{}",
        number, how,
        member(seen, "asked").empty()
            ? ""
            : "Of a strip that it asks about say --wood or --no-wood in place of --override.\n");
  return text + fmt::format(
                    "Its picture: `veneerctl panel proposals {0} --picture scan.png`. Drop it: `veneerctl panel "
                    "refuse {0}`\n",
                    number);
}

// What nobody has to answer.
std::string remark_lines(const json& seen) {
  std::string text;
  for (const json& remark : member(seen, "remarks"))
    if (remark.is_string()) text += fmt::format("Remark: {}\n", remark.get<std::string>());
  return text;
}

// The strips that somebody is asked about.
std::string asked_lines(const json& proposal) {
  std::string text;
  for (const json& strip : member(proposal, "asked"))
    text += line("Asked", fmt::format("{}: {} sure, {}", text_or(strip, "warning", "?"), sureness(strip),
                                      member(strip, "taken") == json(true) ? "taken for wood" : "left out"));
  return text;
}

std::string changed_wood(const json& seen) {
  std::string text;
  if (member(seen, "lost_mm2").is_number()) text += line("Would take", square_cm(seen, "lost_mm2"));
  if (member(seen, "gained_mm2").is_number()) text += line("Would give", square_cm(seen, "gained_mm2"));
  return text;
}

std::string names_text(const json& list, const char* none) {
  std::vector<std::string> names;
  for (const json& one : list)
    if (one.is_string()) names.push_back(one.get<std::string>());
  return names.empty() ? none : joined(names, ", ");
}

}  // namespace

std::string render_scan_result(const json& result) {
  std::string text;
  const std::string panel = text_or(result, "panel", "");
  const json& waiting = member(result, "proposal");
  if (panel.empty() && !waiting.is_number())
    return "Scanned. Move the panel so that the next tile overlaps one that is scanned, and scan again; leave --more "
           "out at the last one.\n";
  if (waiting.is_number())
    text += fmt::format("Proposal {}: {}\n", waiting.get<std::int64_t>(),
                        panel.empty() ? "a new panel" : "a scan of panel " + panel);
  else
    text += "Panel " + panel + "\n";
  if (const std::string parent = text_or(result, "part_of", ""); !parent.empty())
    text += line("Part of", waiting.is_number() ? parent
                                                : fmt::format("{}, with {} places where its wood was gone", parent,
                                                              whole_or(result, "carried", 0)));
  text += line("Size", size_words(result));
  if (member(result, "usable_mm2").is_number())
    text +=
        line("Usable", fmt::format("{} in {} strips", square_cm(result, "usable_mm2"), whole_or(result, "zones", 0)));
  if (waiting.is_number()) text += changed_wood(result);
  const json& registration = member(result, "registration");
  if (registration.is_object() && member(registration, "rms_mm").is_number()) text += render_registration(registration);
  if (const json& added = member(result, "new_tags"); added.is_array() && !added.empty()) {
    std::vector<std::string> tags;
    for (const json& tag : added) tags.push_back(tag.dump());
    text += line("New tags", joined(tags, ", ") + (waiting.is_number() ? ", once it is accepted" : ""));
  }
  const json& differences = member(result, "differences");
  if (differences.is_array()) {
    text += line("Ledger", differences.empty() ? "agrees with the wood"
                                               : fmt::format("{} DIFFERENCES from the wood", differences.size()));
    for (const json& difference : differences) text += line("", difference_words(difference));
  }
  // A proposal: a person says what became of it.
  if (const json& suspects = member(result, "suspects"); suspects.is_array())
    for (const json& piece : suspects)
      text +=
          line("Suspect", fmt::format("{0} of job {1}: {2}. Look, then `veneerctl job settle {1} {0}`",
                                      text_or(piece, "mark", "?"), whole_or(piece, "job", 0), sighting_words(piece)));
  text += remark_lines(result) + warning_lines(result);
  return waiting.is_number() ? text + next_steps(result, waiting.get<std::int64_t>()) : text;
}

std::string render_proposals(const json& reply) {
  const json& proposals = member(reply, "proposals");
  if (!proposals.is_array() || proposals.empty())
    return "No scan waits to be accepted. `veneerctl panel proposals --all` shows decided ones.\n";
  TextTable table({">NUMBER", "MADE", "PANEL", ">SIZE", ">USABLE", "WARNINGS", "DECIDED"});
  for (const json& proposal : proposals) {
    std::vector<std::string> warnings;
    for (const json& warning : member(proposal, "warnings")) warnings.push_back(text_or(warning, "name", "?"));
    const json& decision = member(proposal, "decided");
    table.add({std::to_string(whole_or(proposal, "number", 0)), text_or(proposal, "made", ""),
               text_or(proposal, "panel", "new"), size_words(proposal), square_cm(proposal, "usable_mm2"),
               warnings.empty() ? "none" : joined(warnings, ", "),
               decision.is_object() ? joined({text_or(decision, "verdict", "?"), text_or(decision, "panel", "")}, ", ")
                                    : "open"});
  }
  return table.str();
}

std::string render_proposal(const json& proposal) {
  const std::string panel = text_or(proposal, "panel", "");
  const auto number = whole_or(proposal, "number", 0);
  std::string text =
      fmt::format("Proposal {}: {}\n", number, panel.empty() ? "a new panel" : "a scan of panel " + panel);
  text += line("Scanned", text_or(proposal, "made", "") + " by " + text_or(proposal, "who", "?"));
  text += line("Size", size_words(proposal));
  text += line("Usable", square_cm(proposal, "usable_mm2"));
  if (!panel.empty()) text += changed_wood(proposal);
  text += remark_lines(proposal) + warning_lines(proposal) + asked_lines(proposal);
  const json& decision = member(proposal, "decided");
  if (!decision.is_object()) return text + next_steps(proposal, number);
  text += line("Decided", fmt::format("{} by {}, {}", text_or(decision, "verdict", "?"), text_or(decision, "who", "?"),
                                      text_or(decision, "at", "")));
  text += line("Panel", text_or(decision, "panel", ""));
  text += line("Overruled", names_text(member(decision, "overruled"), ""));
  return text + line("Note", text_or(decision, "note", ""));
}

std::string render_refused(const json& result) {
  return fmt::format("Proposal {} was dropped. The stock is as it was.\n", whole_or(result, "proposal", 0));
}

std::string render_edits(const json& reply) {
  const std::string panel = text_or(reply, "panel", "?");
  const json& edits = member(reply, "edits");
  if (!edits.is_array() || edits.empty())
    return fmt::format("Nothing was given to the mask of panel {} by hand, and nothing withheld.\n", panel);
  TextTable table({">NUMBER", "WHAT", ">AREA", "WHO", "AT", "NOTE"});
  for (const json& edit : edits) {
    const bool removed = member(edit, "removed").is_object();
    table.add({std::to_string(whole_or(edit, "number", 0)),
               text_or(edit, "kind", "?") + (removed ? ", taken back" : ""), square_cm(edit, "area_mm2"),
               text_or(edit, "who", ""), text_or(edit, "at", ""), text_or(edit, "note", "")});
  }
  return table.str();
}

// Its corners as --give and --withhold take them; of an outline with holes ring by ring.
std::string render_edit(const json& edit) {
  std::string text = fmt::format("Edit {} of the mask of panel {}: {}\n", whole_or(edit, "number", 0),
                                 text_or(edit, "panel", "?"), text_or(edit, "kind", "?"));
  text += line("Area", square_cm(edit, "area_mm2"));
  text += line("Painted", text_or(edit, "at", "") + " by " + text_or(edit, "who", "?"));
  if (const json& removed = member(edit, "removed"); removed.is_object())
    text += line("Taken back", text_or(removed, "at", "") + " by " + text_or(removed, "who", "?"));
  text += line("Note", text_or(edit, "note", ""));
  for (const json& ring : member(edit, "shape_mm")) {
    std::vector<std::string> corners;
    for (const json& p : ring)
      if (p.is_array() && p.size() == 2 && p[0].is_number() && p[1].is_number())
        corners.push_back(fmt::format("{},{}", p[0].get<double>(), p[1].get<double>()));
    text += line("Outline", joined(corners, " "));
  }
  return text;
}

std::string render_edited(const json& reply) {
  const std::string panel = text_or(reply, "panel", "?");
  const double changed = number_or(reply, "changed_mm2", 0);
  std::string text = fmt::format("Panel {}: {} of usable wood, {:.1f} cm2 {} than before (version {}).\n", panel,
                                 square_cm(reply, "usable_mm2"), std::abs(changed) / 100, changed < 0 ? "less" : "more",
                                 whole_or(reply, "version", 0));
  if (const json& number = member(reply, "number"); number.is_number())
    text += fmt::format("Take it back: `veneerctl panel mask {} --remove {}`\n", panel, number.get<std::int64_t>());
  std::vector<std::string> pieces;
  for (const json& piece : member(reply, "reserved"))
    pieces.push_back(fmt::format("{} of job {}", text_or(piece, "mark", "?"), whole_or(piece, "job", 0)));
  if (!pieces.empty())
    text +=
        fmt::format("Pieces that are reserved there are cut all the same: {}. Cancel their job if they must not be.\n",
                    joined(pieces, ", "));
  return text;
}

std::string render_merged(const json& reply) {
  const std::string panel = text_or(reply, "panel", "?"), merged = text_or(reply, "merged", "?");
  if (member(reply, "other_face") == json(true))
    return fmt::format("Panel {1} is the other face of panel {0}: its tags are known there now.\n", panel, merged);
  return fmt::format(
      "Panel {1} is panel {0}: what was cut from it is booked there. Scan panel {0} before it is used.\n", panel,
      merged);
}

}  // namespace veneer::cli
