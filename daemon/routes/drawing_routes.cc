// A drawing's file, read by a worker for whoever shows it before it is burnt. Nothing here moves anything:
// POST /laser/run is asked to burn what was read (laser_routes.cc).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/utf8.h"
#include "daemon/plans/drawn_file.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

// "0.5,,0.2": of each kind of line in turn, nothing where nobody says.
std::optional<std::vector<std::optional<double>>> list_for_kinds(RequestReader& query, const char* name,
                                                                 NumberRange range, bool whole) {
  const auto text = query.text(name);
  if (!text) return std::nullopt;
  std::vector<std::optional<double>> out;
  for (std::size_t at = 0; at <= text->size();) {
    const std::size_t end = std::min(text->find(',', at), text->size());
    const std::string entry = text->substr(at, end - at);
    const auto number = parse_number(entry);
    const bool usable_number =
        number && *number >= range.least && *number <= range.most && (!whole || *number == std::floor(*number));
    if (!usable_number && !entry.empty()) {
      query.refuse(
          unusable(fmt::format("{} has \"{}\": it must be a list of {}numbers from {} to {}, separated by "
                               "commas, with nothing for a kind of line of which nobody says it",
                               name, beginning_of(entry, 60), whole ? "whole " : "", range.least, range.most)));
      return std::nullopt;
    }
    out.push_back(number);
    at = end + 1;
  }
  return out;
}

// How each kind of line is burnt, as far as it is said.
std::vector<DrawnSetting> given_settings(RequestReader& query) {
  const auto powers = list_for_kinds(query, "powers", ranges::kPower, false);
  const auto speeds = list_for_kinds(query, "speeds_mm_s", ranges::kSpeed, false);
  const auto passes = list_for_kinds(query, "passes", ranges::kPasses, true);
  const auto air = list_for_kinds(query, "air", ranges::kSwitch, true);
  std::optional<std::size_t> kinds;
  for (const auto* list : {&powers, &speeds, &passes, &air}) {
    if (!*list) continue;
    if (kinds && *kinds != (*list)->size())
      query.refuse(
          unusable("powers, speeds_mm_s, passes and air are not equally long: give one for each kind of line"));
    kinds = (*list)->size();
  }
  std::vector<DrawnSetting> out(kinds.value_or(0));
  const auto of = [](const auto& list, std::size_t i) { return list && i < list->size() ? (*list)[i] : std::nullopt; };
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].power = of(powers, i), out[i].speed_mm_s = of(speeds, i);
    if (const auto times = of(passes, i)) out[i].passes = static_cast<int>(*times);
    if (const auto on = of(air, i)) out[i].air = *on != 0;
  }
  return out;
}

// What burns it, once all of it is said: as POST /laser/run takes it beside the points.
nlohmann::json run_settings_json(const DrawingRead& read) {
  nlohmann::json speeds = nlohmann::json::array(), powers = speeds, passes = speeds, air = speeds;
  for (const std::size_t kind : read.kind_of_stroke) {
    const DrawnSetting& its = read.kinds[kind].setting;
    if (!its.power || !its.speed_mm_s) return nullptr;
    speeds.push_back(*its.speed_mm_s), powers.push_back(*its.power);
    passes.push_back(its.passes.value_or(1)), air.push_back(its.air.value_or(false) ? 1 : 0);
  }
  return {{"speeds_mm_s", std::move(speeds)},
          {"powers", std::move(powers)},
          {"passes", std::move(passes)},
          {"air", std::move(air)}};
}

// Without ways between lines; none while nobody says how some are burnt.
std::optional<double> burning_seconds(const DrawingRead& read) {
  double seconds = 0;
  for (const DrawnKind& kind : read.kinds) {
    if (!kind.setting.power || !kind.setting.speed_mm_s) return std::nullopt;
    seconds += kind.length_mm * kind.setting.passes.value_or(1) / *kind.setting.speed_mm_s;
  }
  return seconds;
}

nlohmann::json box_json(const std::array<double, 2>& min, const std::array<double, 2>& max) {
  return {{"min_mm", min}, {"max_mm", max}};
}

// Null where the laser has not told yet how far it travels.
nlohmann::json drawing_json(const DrawingRead& read, const Box<MachineFrame>& travel) {
  const auto maybe = [](const auto& value) { return value ? nlohmann::json(*value) : nlohmann::json(); };
  nlohmann::json kinds = nlohmann::json::array();
  for (const DrawnKind& kind : read.kinds)
    kinds.push_back({{"layer", kind.layer},
                     {"colour", kind.colour},
                     {"lines", kind.lines},
                     {"length_mm", kind.length_mm},
                     {"power", maybe(kind.setting.power)},
                     {"speed_mm_s", maybe(kind.setting.speed_mm_s)},
                     {"passes", kind.setting.passes.value_or(1)},
                     {"air", kind.setting.air.value_or(false)}});
  nlohmann::json out = {{"page_mm", read.page_mm},
                        {"extent", box_json(read.least_mm, read.most_mm)},
                        {"warnings", read.warnings},
                        {"length_mm", read.length_mm},
                        {"burning_s", maybe(burning_seconds(read))},
                        {"kinds", std::move(kinds)},
                        {"kind_of_stroke", read.kind_of_stroke},
                        {"points_mm", read.points_mm},
                        {"strokes", read.strokes},
                        {"settings", run_settings_json(read)},
                        {"travel", nullptr},
                        {"fits", nullptr}};
  if (travel.empty()) return out;
  out["travel"] = box_json({travel.min.x.count(), travel.min.y.count()}, {travel.max.x.count(), travel.max.y.count()});
  out["fits"] = travel.contains(point<MachineFrame>(read.least_mm[0], read.least_mm[1])) &&
                travel.contains(point<MachineFrame>(read.most_mm[0], read.most_mm[1]));
  return out;
}

// For whoever shows a drawing before it is burnt. Nothing moves, and nothing of it is kept.
void read_drawing_of(const DrawingServices& s, const ApiRequest& asked, const Reply& reply) {
  auto query = RequestReader::query_of(asked);
  ReadDrawing wanted;
  wanted.x_mm = query.number("x_mm", ranges::kPlace), wanted.y_mm = query.number("y_mm", ranges::kPlace);
  if (wanted.x_mm.has_value() != wanted.y_mm.has_value())
    query.refuse(unusable("x_mm and y_mm are given together: give both of the lines' lower left corner"));
  wanted.given = given_settings(query);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  if (asked.body.empty()) return reply(ApiReply::error(unusable("there is no drawing: send an SVG's bytes")));
  wanted.recipes = {{"cut", s.recipe.cut_power.count(), s.recipe.cut_speed.count()},
                    {"engrave", s.recipe.engrave_power.count(), s.recipe.engrave_speed.count()}};
  s.sketches.ask(asked, reply,
                 [body = asked.body, gone = asked.gone, wanted = std::move(wanted), &workers = s.workers,
                  data_dir = s.data_dir, travel = s.unit.limits().travel](Repositories&) -> QueryPool::Answer {
                   return [=, &workers](Repositories&) {
                     const auto read = read_drawn_file(body.text(), wanted, data_dir, workers, gone);
                     return read ? ApiReply::json(drawing_json(*read, travel)) : ApiReply::error(read.error());
                   };
                 });
}

}  // namespace

void bind_drawing_routes(Router& router, const DrawingServices& s) {
  router.bind("readDrawing",
              [s](const ApiRequest& request, const Reply& reply) { read_drawing_of(s, request, reply); });
}

}  // namespace veneer::daemon
