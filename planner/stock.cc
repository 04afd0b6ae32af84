#include "planner/stock.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace veneer::planner {
namespace {

Error no_such_species(std::span<const StockPanel> stock, const std::string& species) {
  std::set<std::string> known;
  for (const StockPanel& panel : stock)
    if (!panel.species.empty()) known.insert(panel.species);
  return {ErrorCode::kInvalidArgument,
          known.empty() ? fmt::format("no panel is known to be {}, because none names its material: name it", species)
                        : fmt::format("no panel is {}: choose from {}", species, fmt::join(known, ", "))};
}

}  // namespace

Result<std::vector<StockPanel>> only_species(std::span<const StockPanel> stock, std::span<const std::string> species) {
  std::vector<StockPanel> out;
  for (const std::string& name : species)
    if (std::none_of(stock.begin(), stock.end(), [&](const StockPanel& panel) { return panel.species == name; }))
      return no_such_species(stock, name);
  for (const StockPanel& panel : stock)
    if (species.empty() || std::find(species.begin(), species.end(), panel.species) != species.end())
      out.push_back(panel);
  return out;
}

Status weigh_tones(std::span<StockPanel> stock, const std::string& species, double weight) {
  if (!(weight >= 0 && weight <= 1000))
    return Error{ErrorCode::kInvalidArgument, fmt::format("the weight of {} must lie between 0 and 1000", species)};
  bool found = false;
  for (StockPanel& panel : stock)
    if (panel.species == species) panel.tone_weight = weight, found = true;
  if (!found) return no_such_species(stock, species);
  return Ok();
}

}  // namespace veneer::planner
