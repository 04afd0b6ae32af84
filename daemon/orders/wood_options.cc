#include "daemon/orders/wood_options.h"

#include <algorithm>

#include "daemon/orders/wood_recipes.h"
#include "planner/cutting/lead_choice.h"
#include "planner/plan_options.h"

namespace veneer::daemon {

Result<planner::PlanOptions> wood_options(const std::map<std::string, std::string>& named, const JobWood& wood,
                                          std::span<const planner::StockPanel> stock, Millimetres kerf,
                                          const std::vector<db::RecipeRecord>& recipes) {
  planner::PlanOptions out;
  for (const auto& [name, text] : named)
    if (const Status set = planner::set_option(out, name, text); !set) return set.error();
  for (const auto& [material, share] : wood.wood_limits) out.material_limits.push_back({material, share});
  out.kerf = kerf;
  for (const auto& panel : stock) {
    const auto held = std::ranges::find(wood.panels, panel.id, &HeldPanel::id);
    if (held != wood.panels.end())
      out.kerf = std::max(out.kerf, WoodRecipes({}, kerf, recipes, held->zones).widest_kerf());
  }
  out.web = web_of(out.layout, out.refine);
  return out;
}

// Chips would fall out between curved borders that touch, booked by nobody (docs/KERF.md).
Millimetres web_of(planner::LayoutKind layout, planner::Refine refine) {
  const bool straight = layout == planner::LayoutKind::kGrid && refine == planner::Refine::kNone;
  return straight ? Millimetres(0) : planner::kPieceWeb;
}

}  // namespace veneer::daemon
