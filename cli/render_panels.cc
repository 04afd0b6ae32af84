#include "cli/render.h"

#include <fmt/format.h>

#include <vector>

#include "cli/json_read.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

// A line for what nobody has decided on yet; "" when there is nothing.
std::string open_differences_words(const json& panel) {
  const auto open = whole_or(panel, "open_differences", 0);
  if (open == 0) return "";
  const std::string id = text_or(panel, "id", "?");
  return fmt::format("{}: wood and ledger disagree in {}: `veneerctl panel differences {}`\n", id,
                     open == 1 ? "1 place" : fmt::format("{} places", open), id);
}

constexpr const char* kUnreadable =
    "its mask cannot be read, so that nobody knows what of it is free: put the file back from a backup, or scan the "
    "panel";

std::string panels_text(const json& panels, bool named) {
  std::vector<std::string> headings{"PANEL", ">SIZE", ">FREE", ">RESERVED", ">CUT", "FACES", ">FIT", "FROM"};
  if (named) headings.insert(headings.end(), {"NAME", "SHELF", "WOODS"});
  TextTable table(headings);
  std::string notes;
  int uncounted = 0;
  for (const json& panel : panels) {
    const json& book = member(panel, "area_book_mm2");
    const std::string mask = text_or(panel, "mask", "");
    std::vector<std::string> row{text_or(panel, "id", "?"),       size_of(panel),
                                 square_cm(book, "free"),         square_cm(book, "reserved"),
                                 square_cm(book, "cut"),          names_of(member(panel, "faces")),
                                 millimetres(panel, "rms_mm", 3), text_or(panel, "parent", "")};
    if (named)
      row.insert(row.end(),
                 {text_or(panel, "name", ""), text_or(panel, "shelf", ""), names_of(member(panel, "woods"))});
    table.add(std::move(row));
    if (const json& why = member(panel, "retired"); why.is_object())
      notes += fmt::format("{} is retired: {}\n", text_or(panel, "id", "?"), text_or(why, "reason", "?"));
    if (const std::string why = text_or(panel, "scan_again", ""); !why.empty())
      notes += "Waits for a scan: " + why + "\n";
    notes += open_differences_words(panel);
    if (mask == "unreadable") notes += fmt::format("{}: {}\n", text_or(panel, "id", "?"), kUnreadable);
    if (mask == "uncounted") ++uncounted;
  }
  return table.str() + notes + uncounted_words(uncounted);
}

}  // namespace

std::string render_panels(const json& reply) {
  const json& panels = member(reply, "panels");
  if (!panels.is_array() || panels.empty())
    return whole_or(reply, "retired_left_out", 0) > 0
               ? "No panels in stock: all were retired. `veneerctl panel list --all` shows them.\n"
               : "No panels yet. Lay one on the scanner and run `veneerctl panel scan`.\n";
  return panels_text(panels, false);
}

std::string render_named_panels(const json& reply) {
  if (const json& panels = member(reply, "panels"); panels.is_array() && !panels.empty())
    return panels_text(panels, true);
  return whole_or(reply, "retired_left_out", 0) > 0
             ? "Only retired panels are called so: add --all to see them.\n"
             : "No panel has all of these words in its number, name, shelf place, woods or parent: leave one out.\n";
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
    text += line("Area", kUnreadable);
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
                       same.is_number() ? fmt::format("version {} again", same.get<int>()) : "",
                       member(version, "painted") == json(true) ? "with edits by hand" : ""},
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
  std::string out =
      line("Registered",
           joined({"RMS " + millimetres(registration, "rms_mm", 3), "worst " + millimetres(registration, "max_mm", 3)},
                  ", "));
  const json& scans = member(registration, "scans");
  if (!scans.is_array()) return out;
  for (const json& scan : scans) {
    const json& fiducials = member(scan, "fiducials");
    if (!fiducials.is_array()) continue;
    std::vector<std::string> parts;
    for (const json& one : fiducials) {
      const bool is_tag = member(one, "tag_id").is_number_integer();
      parts.push_back(fmt::format("{} {}{}", is_tag ? fmt::format("tag {}", whole_or(one, "tag_id", 0)) : "hole",
                                  millimetres(one, "off_mm", 3),
                                  one.value("over_limit", false) ? " (over 0.05 mm)" : ""));
    }
    out += line(fmt::format("Scan {}", whole_or(scan, "id", 0)),
                fmt::format("{} face: {}", text_or(scan, "face", "?"), joined(parts, ", ")));
  }
  return out;
}

std::string render_zones(const json& panel) {
  const json& list = member(panel, "zones");
  if (!list.is_array() || list.empty()) return "";
  TextTable table({">ZONE", "MATERIAL", ">AREA", ">SURE"});
  for (const json& zone : list)
    table.add({std::to_string(whole_or(zone, "zone", 0)), text_or(zone, "material", "not named"),
               square_cm(zone, "area_mm2"), sureness(zone)});
  return table.str();
}

}  // namespace veneer::cli
