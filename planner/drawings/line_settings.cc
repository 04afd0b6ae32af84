#include "planner/drawings/line_settings.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace veneer::planner {

LineSetting first_of(const LineSetting& a, const LineSetting& b) {
  return {a.power ? a.power : b.power, a.speed_mm_s ? a.speed_mm_s : b.speed_mm_s, a.passes ? a.passes : b.passes,
          a.air ? a.air : b.air};
}

Result<std::vector<LineSetting>> settings_of(const Drawing& drawing, const LineSetting& all,
                                             const NamedSettings& named) {
  std::set<std::string> used;
  std::vector<LineSetting> settings;
  for (const DrawnLine& line : drawing.lines) {
    LineSetting its = all;
    for (const std::string& name : {line.colour, line.layer}) {
      const auto found = named.find(name);
      if (name.empty() || found == named.end()) continue;
      used.insert(name);
      its = first_of(found->second, its);
    }
    settings.push_back(first_of(its, {line.power, line.speed_mm_s, line.passes, line.air}));
  }
  for (const auto& [name, setting] : named)
    if (!used.contains(name)) return unusable(fmt::format("the drawing has no layer and no colour \"{}\"", name));
  return settings;
}

void fill_from_recipes(const Drawing& drawing, const NamedSettings& recipes, std::vector<LineSetting>& settings) {
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const auto recipe = recipes.find(drawing.lines[i].layer);
    if (recipe == recipes.end()) continue;
    settings[i] = first_of(settings[i], {recipe->second.power, recipe->second.speed_mm_s, {}, {}});
  }
}

std::set<std::string> untold(const Drawing& drawing, const std::vector<LineSetting>& settings) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    if (settings[i].power && settings[i].speed_mm_s) continue;
    const DrawnLine& line = drawing.lines[i];
    names.insert(!line.layer.empty()    ? line.layer
                 : !line.colour.empty() ? line.colour
                                        : "lines without layer and colour");
  }
  return names;
}

DrawnLineKinds kinds_of(const Drawing& drawing) {
  DrawnLineKinds out;
  std::map<std::pair<std::string, std::string>, std::size_t> known;
  for (const DrawnLine& line : drawing.lines) {
    const auto [found, is_new] = known.try_emplace({line.layer, line.colour}, out.kinds.size());
    if (is_new) out.kinds.push_back({line.layer, line.colour});
    DrawnLineKind& kind = out.kinds[found->second];
    ++kind.lines;
    for (std::size_t i = 1; i < line.points.size(); ++i)
      kind.length_mm +=
          std::hypot(line.points[i][0] - line.points[i - 1][0], line.points[i][1] - line.points[i - 1][1]);
    out.of_line.push_back(found->second);
  }
  return out;
}

DrawingPoint move_to_corner(const Drawing& drawing, std::optional<double> x_mm, std::optional<double> y_mm) {
  const DrawingExtent extent = extent_of(drawing);
  return {x_mm ? *x_mm - extent.min_x : 0, y_mm ? *y_mm - extent.min_y : 0};
}

DrawingPoint moved(const DrawingPoint& at, const DrawingPoint& by) {
  const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4; };
  return {rounded(at[0] + by[0]), rounded(at[1] + by[1])};
}

}  // namespace veneer::planner
