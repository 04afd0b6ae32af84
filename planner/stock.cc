#include "planner/stock.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace veneer::planner {
namespace {

Error no_such_material(std::span<const StockPanel> stock, const std::string& material) {
  std::set<std::string> known;
  for (const StockPanel& panel : stock) {
    if (!panel.material.empty()) known.insert(panel.material);
    for (const WoodZone& zone : panel.zones) known.insert(zone.material);
  }
  return {ErrorCode::kInvalidArgument,
          known.empty() ? fmt::format("no panel is known to be {}, because none names its material: name it", material)
                        : fmt::format("no panel is {}: choose from {}", material, fmt::join(known, ", "))};
}

}  // namespace

Result<std::vector<StockPanel>> only_materials(std::span<const StockPanel> stock,
                                               std::span<const std::string> materials) {
  std::vector<StockPanel> out;
  for (const std::string& name : materials)
    if (std::none_of(stock.begin(), stock.end(), [&](const StockPanel& panel) { return panel.material == name; }))
      return no_such_material(stock, name);
  for (const StockPanel& panel : stock)
    if (materials.empty() || std::find(materials.begin(), materials.end(), panel.material) != materials.end())
      out.push_back(panel);
  return out;
}

Status weigh_tones(std::span<StockPanel> stock, const std::string& material, double weight) {
  if (!(weight >= 0 && weight <= 1000))
    return Error{ErrorCode::kInvalidArgument, fmt::format("the weight of {} must lie between 0 and 1000", material)};
  bool found = false;
  for (StockPanel& panel : stock) {
    if (panel.material == material) panel.tone_weight = weight, found = true;
    for (WoodZone& zone : panel.zones)
      if (zone.material == material) zone.tone_weight = weight, found = true;
  }
  if (!found) return no_such_material(stock, material);
  return Ok();
}

Status is_in_stock(std::span<const StockPanel> stock, const std::string& material) {
  const bool there = std::ranges::any_of(stock, [&](const StockPanel& panel) {
    return panel.material == material ||
           std::ranges::any_of(panel.zones, [&](const WoodZone& zone) { return zone.material == material; });
  });
  if (!there) return no_such_material(stock, material);
  return Ok();
}

}  // namespace veneer::planner
