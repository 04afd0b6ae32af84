// What a piece tells of its life.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/render_words.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string burn_words(const json& burn) {
  if (!burn.is_object()) return "";
  const auto passes = whole_or(burn, "passes", 1);
  return fmt::format("{:.4g} mm/s, {:.0f} % power{}{}", number_or(burn, "speed_mm_s", 0),
                     100 * number_or(burn, "power", 0), passes > 1 ? fmt::format(", {} passes", passes) : "",
                     flag_or(burn, "air", false) ? ", with air" : "");
}

std::string certificate_line(const json& certificate) {
  return line(
      "Certificate",
      fmt::format("{} {}, issued {}, {:.3f} mm", whole_or(certificate, "id", 0), text_or(certificate, "kind", "?"),
                  moment_words(text_or(certificate, "issued", "")), number_or(certificate, "rms_mm", 0)));
}

// Where on the panel it was cut out: how large, and from which lower left corner on; its corners too, where they are
// few.
std::string outline_lines(const json& outline) {
  constexpr std::size_t kFew = 8;
  std::vector<std::pair<double, double>> corners;
  for (const json& point : outline) {
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) return "";
    corners.emplace_back(point[0].get<double>(), point[1].get<double>());
  }
  if (corners.empty()) return "";
  auto low = corners.front(), high = low, before = corners.back();
  double twice = 0;
  std::string named;
  for (const auto& [x, y] : corners) {
    low = {std::min(low.first, x), std::min(low.second, y)};
    high = {std::max(high.first, x), std::max(high.second, y)};
    twice += before.first * y - x * before.second;
    before = {x, y};
    named += fmt::format("{}{:.2f}, {:.2f}", named.empty() ? "" : "; ", x, y);
  }
  std::string text = line("Outline", fmt::format("{} corners, {:.1f} x {:.1f} mm from {:.1f}, {:.1f} mm on, {:.1f} mm2",
                                                 corners.size(), high.first - low.first, high.second - low.second,
                                                 low.first, low.second, std::abs(twice) / 2));
  if (corners.size() <= kFew) text += line("", named);
  return text;
}

std::string wood_lines(const json& wood, const json& run) {
  if (!wood.is_object()) return line("Wood", "none was found for it");
  const std::string material = text_or(member(run, "recipe"), "material", "");
  const std::string root = text_or(wood, "root", "");
  std::string text = line("Wood", fmt::format("panel {}{}{}", text_or(wood, "panel", "?"),
                                              root.empty() || root == text_or(wood, "panel", "") ? "" : " of " + root,
                                              material.empty() ? "" : ", " + material));
  text += outline_lines(member(wood, "outline_mm"));
  text += line("Turned", fmt::format("{:.1f} degrees", number_or(wood, "rotation_deg", 0)));
  const std::string map = text_or(wood, "map_sha256", "");
  if (!map.empty())
    text += line("Seen as",
                 fmt::format("version {} of the panel, map {}", whole_or(wood, "mask_version", 0), map.substr(0, 12)));
  for (const json& scan : member(wood, "scans"))
    text += line("", fmt::format("scan {} of the {} face, {}, {}", whole_or(scan, "id", 0), text_or(scan, "face", "?"),
                                 moment_words(text_or(scan, "taken", "")), text_or(scan, "sha256", "").substr(0, 12)));
  // Of all those scans it is mostly the same.
  std::set<std::int64_t> told;
  for (const json& scan : member(wood, "scans"))
    if (const json& known = member(scan, "certificate");
        known.is_object() && told.insert(whole_or(known, "id", 0)).second)
      text += certificate_line(known);
  return text;
}

std::string run_lines(const json& run) {
  if (!run.is_object()) return "";
  const std::string who = text_or(run, "who", "");
  std::string text =
      line("Cut", fmt::format("in run {}{}, {}", whole_or(run, "id", 0), who.empty() ? "" : ", started by " + who,
                              moment_words(text_or(run, "started", ""))));
  text += line("Pose", fmt::format("found to {:.3f} mm", number_or(run, "pose_rms_mm", 0)));
  const json& recipe = member(run, "recipe");
  text += line("Burnt with", burn_words(member(recipe, "cut")));
  text += line("Mark with", burn_words(member(recipe, "engrave")));
  for (const json& certificate : member(run, "certificates")) text += certificate_line(certificate);
  return text;
}

}  // namespace

std::string render_passport(const json& piece) {
  const json& job = member(piece, "job");
  std::string text = fmt::format("Piece {} of job {}, {}\n", text_or(piece, "mark", "?"), whole_or(job, "id", 0),
                                 text_or(piece, "state", "?"));
  text += line("Picture", text_or(job, "name", ""));
  text += line("Number", std::to_string(whole_or(piece, "id", 0)));
  text += line("Beside", names_of(member(piece, "neighbours")));
  text += wood_lines(member(piece, "wood"), member(piece, "run"));
  text += run_lines(member(piece, "run"));
  std::string label = "History";
  for (const json& step : member(piece, "history")) {
    text += line(label, fmt::format("{}  {} on panel {}", moment_words(text_or(step, "at", "")),
                                    text_or(step, "state", "?"), text_or(step, "panel", "?")));
    label.clear();
  }
  return text;
}

std::string render_place(const json& reply) {
  const json& booked = member(reply, "allocations");
  if (!booked.is_array() || booked.empty()) return "Nothing is booked there.\n";
  std::string text;
  for (const json& entry : booked) {
    const std::string state = text_or(entry, "state", "?"), since = moment_words(text_or(entry, "since", ""));
    if (whole_or(entry, "plan", 0) != 0)
      text +=
          fmt::format("Leased to plan {0} since {1}: `veneerctl job plans {0}`\n", whole_or(entry, "plan", 0), since);
    else if (const auto before = whole_or(entry, "piece_before", 0); before != 0)
      text += fmt::format("{}, {} before this panel was sawn off on {}: `veneerctl piece show {}`\n",
                          text_or(entry, "reason", "?"), state, since, before);
    else if (whole_or(entry, "piece", 0) == 0)
      text += fmt::format("Written off since {}: {}\n", since, text_or(entry, "reason", "?"));
    else
      text += fmt::format("{} {} of job {}, {} since {}: `veneerctl piece show {}`\n",
                          flag_or(entry, "lead_in", false) ? "In the lead-in of piece"
                          : flag_or(entry, "kerf", false)  ? "In the kerf of piece"
                                                           : "Piece",
                          text_or(entry, "mark", "?"), whole_or(entry, "job", 0), state, since,
                          whole_or(entry, "piece", 0));
    if (text.starts_with("piece")) text[0] = 'P';
  }
  return text;
}

}  // namespace veneer::cli
