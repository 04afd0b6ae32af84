#include "daemon/orders/drawing_work.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "base/utf8.h"
#include "daemon/orders/drawing_json.h"
#include "planner/drawings/line_settings.h"

namespace veneer::daemon {
namespace {

constexpr std::size_t kLongestName = 200;  // bytes, of a layer or colour: a person reads it

planner::LineSetting setting_of(const DrawnSetting& its) { return {its.power, its.speed_mm_s, its.passes, its.air}; }
DrawnSetting drawn_setting(const planner::LineSetting& its) {
  return {its.power, its.speed_mm_s, its.passes.value_or(1), its.air.value_or(false)};
}

Result<planner::Drawing> drawing_of(const ReadDrawing& order) {
  std::ifstream file(order.file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  auto drawing = planner::read_svg(text, order.most_points);
  if (!drawing) return drawing;
  if (!planner::is_finite(*drawing)) return unusable("a point of the drawing is no number: save it anew");
  if (!std::isfinite(drawing->page[0]) || !std::isfinite(drawing->page[1]))
    return unusable("the drawing's width or height is no number: give its page a size in mm");
  return drawing;
}

// Of each line, by its kind.
Result<std::vector<planner::LineSetting>> settings_of(const planner::Drawing& drawing,
                                                      const planner::DrawnLineKinds& kinds, const ReadDrawing& order) {
  if (!order.given.empty() && order.given.size() != kinds.kinds.size())
    return unusable(
        fmt::format("the drawing has {} kinds of line, and {} are told how they are burnt: tell of each, in the order "
                    "of the answer",
                    kinds.kinds.size(), order.given.size()));
  std::vector<planner::LineSetting> settings;
  for (const std::size_t kind : kinds.of_line)
    settings.push_back(order.given.empty() ? planner::LineSetting() : setting_of(order.given[kind]));
  planner::NamedSettings recipes;
  for (const LayerRecipe& recipe : order.recipes) recipes[recipe.layer] = {recipe.power, recipe.speed_mm_s, {}, {}};
  planner::fill_from_recipes(drawing, recipes, settings);
  return settings;
}

}  // namespace

Result<DrawingWasRead> read_drawing(const ReadDrawing& order, const std::filesystem::path& folder,
                                    const TaskProgress&) {
  const auto drawing = drawing_of(order);
  if (!drawing) return drawing.error();
  const planner::DrawnLineKinds kinds = planner::kinds_of(*drawing);
  if (kinds.kinds.size() > kMostLineKinds)
    return unusable(
        fmt::format("the drawing has {} layers and colours that differ, and at most {} are told apart: "
                    "give lines that are burnt alike one colour",
                    kinds.kinds.size(), kMostLineKinds));
  for (const planner::DrawnLineKind& kind : kinds.kinds)
    if (kind.layer.size() > kLongestName || kind.colour.size() > kLongestName)
      return unusable(fmt::format("the name of a layer or colour, {}..., is longer than {} bytes: shorten it",
                                  beginning_of(kind.layer.size() > kLongestName ? kind.layer : kind.colour, 40),
                                  kLongestName));
  const auto settings = settings_of(*drawing, kinds, order);
  if (!settings) return settings.error();
  DrawingRead out;
  const planner::DrawingPoint by = planner::move_to_corner(*drawing, order.x_mm, order.y_mm);
  const planner::DrawingExtent extent = planner::extent_of(*drawing);
  out.page_mm = drawing->page;
  out.least_mm = planner::moved({extent.min_x, extent.min_y}, by);
  out.most_mm = planner::moved({extent.max_x, extent.max_y}, by);
  for (const double reach : {out.least_mm[0], out.least_mm[1], out.most_mm[0], out.most_mm[1]})
    if (std::abs(reach) > kFarthestMm)
      return unusable(
          fmt::format("the drawing is {:.4g} x {:.4g} mm and reaches beyond every laser: make it smaller, or "
                      "place it elsewhere",
                      extent.max_x - extent.min_x, extent.max_y - extent.min_y));
  out.warnings = drawing->warnings;
  out.length_mm = planner::length_of(*drawing);
  for (const planner::DrawnLineKind& kind : kinds.kinds)
    out.kinds.push_back({kind.layer, kind.colour, kind.lines, kind.length_mm, {}});
  out.kind_of_stroke = kinds.of_line;
  for (std::size_t i = 0; i < drawing->lines.size(); ++i) {
    out.kinds[kinds.of_line[i]].setting = drawn_setting((*settings)[i]);
    for (const planner::DrawingPoint& point : drawing->lines[i].points)
      for (const double value : planner::moved(point, by)) out.points_mm.push_back(value);
    out.strokes.push_back(drawing->lines[i].points.size());
  }
  // Names of layers are whatever somebody's file has.
  const std::string text = nlohmann::json(out).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::ofstream file(folder / kDrawingReadFile, std::ios::binary);
  if (!file.write(text.data(), static_cast<std::streamsize>(text.size())).flush())
    return Error{ErrorCode::kStorage, "what was read of the drawing cannot be kept: make room on the disk"};
  return DrawingWasRead{out.points_mm.size() / 2};
}

}  // namespace veneer::daemon
