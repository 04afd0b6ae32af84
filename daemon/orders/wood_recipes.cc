#include "daemon/orders/wood_recipes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "planner/cutting/lead_choice.h"

namespace veneer::daemon {
namespace {

// REQUIRES: its cut begins in waste.
Result<planner::Lead<PanelFrame>> lead_of(const db::PieceRecord& piece, const planner::Recipe& recipe,
                                          Millimetres fit_clearance) {
  auto lead = planner::lead_of(piece.panel_outline, *piece.lead_in, recipe, fit_clearance);
  if (!lead) return Error{lead.error().code, fmt::format("piece {} {}", piece.mark, lead.error().message)};
  return lead;
}

}  // namespace

WoodRecipes::WoodRecipes(const RecipeConfig& config, Millimetres kerf, std::vector<db::RecipeRecord> recipes,
                         std::vector<db::ZoneRecord> zones)
    : recipes_(std::move(recipes)), zones_(std::move(zones)) {
  otherwise_.cut_speed = config.cut_speed;
  otherwise_.cut_power = config.cut_power;
  otherwise_.engrave_speed = config.engrave_speed;
  otherwise_.engrave_power = config.engrave_power;
  otherwise_.kerf_back = otherwise_.kerf_show = kerf;
}

Result<WoodRecipes> WoodRecipes::read(Repositories& repositories, const RecipeConfig& config, Millimetres kerf,
                                      const PanelId& panel) {
  auto recipes = repositories.materials.recipes();
  if (!recipes) return recipes.error();
  auto zones = repositories.materials.zones(panel);
  if (!zones) return zones.error();
  return WoodRecipes(config, kerf, std::move(*recipes), std::move(*zones));
}

planner::Recipe WoodRecipes::recipe_of(const std::string& material) const {
  planner::Recipe out = otherwise_;
  for (const auto& recipe : recipes_) {
    if (recipe.material != material) continue;
    if (recipe.operation == db::Operation::kCut) {
      out.cut_speed = recipe.speed;
      out.cut_power = recipe.power;
      out.cut_passes = recipe.passes;
      out.air = recipe.air;
      if (recipe.kerf) out.kerf_back = recipe.kerf->back, out.kerf_show = recipe.kerf->show;
    } else {
      out.engrave_speed = recipe.speed;
      out.engrave_power = recipe.power;
      out.engrave_passes = recipe.passes;
      out.engrave_air = recipe.air;
    }
  }
  return out;
}

std::string WoodRecipes::material_at(const Ring<PanelFrame>& outline) const {
  const Region<PanelFrame> piece(outline);
  const db::ZoneRecord* best = nullptr;
  double most = 0;
  for (const auto& zone : zones_) {
    if (!micro::boxes_overlap(piece.micro_area(), zone.shape.micro_area())) continue;
    if (const double area = intersect(piece, zone.shape).area().count(); area > most) most = area, best = &zone;
  }
  return best == nullptr ? std::string() : best->material;
}

Millimetres WoodRecipes::widest_kerf() const {
  // A piece may lie in no zone at all.
  Millimetres widest = otherwise_.widest_kerf();
  for (const auto& zone : zones_)
    if (!zone.shape.empty()) widest = std::max(widest, recipe_of(zone.material).widest_kerf());
  return widest;
}

planner::ToolpathOptions toolpath_options(const RecipeConfig& config) {
  planner::ToolpathOptions options;
  options.marks.height = config.mark_height;
  options.marks.min_height = config.mark_min_height;
  options.fit_clearance = config.fit_clearance;
  options.leads.length = config.lead_in;
  options.bridges.on = config.bridges;
  options.assembly_order = config.cut_order == "assembly";
  return options;
}

planner::Kinematics kinematics_of(const std::optional<LaserMotion>& machine) {
  planner::Kinematics out;
  if (!machine) return out;
  out.rapid_x = machine->fastest_x, out.rapid_y = machine->fastest_y;
  out.acceleration_x = machine->acceleration_x, out.acceleration_y = machine->acceleration_y;
  out.junction_deviation = machine->junction_deviation;
  out.planner_moves = machine->planner_blocks;
  return out;
}

Result<std::vector<planner::Lead<BedFrame>>> leads_on_bed(const db::PieceRecord& piece, const planner::Recipe& recipe,
                                                          Millimetres fit_clearance,
                                                          const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  std::vector<planner::Lead<BedFrame>> leads;
  if (!piece.lead_in) return leads;
  const auto lead = lead_of(piece, recipe, fit_clearance);
  if (!lead) return lead.error();
  leads.push_back({bed_from_panel * lead->begin, bed_from_panel * lead->end});
  return leads;
}

Status check_booked(const db::PieceRecord& piece, const std::string& material, const planner::Recipe& recipe,
                    Millimetres fit_clearance, const Region<PanelFrame>& booked) {
  const Millimetres slack(0.005);  // shapes are stored in whole micrometres
  const Millimetres kerf = recipe.widest_kerf(), burnt_width = std::max(Millimetres(0), kerf - slack);
  auto burnt = offset(Region<PanelFrame>(piece.panel_outline), burnt_width);
  if (piece.lead_in) {
    const auto lead = lead_of(piece, recipe, fit_clearance);
    if (!lead) return lead.error();
    burnt = unite(burnt, planner::lead_burn(*lead, kerf - 2 * slack));
  }
  if (subtract(burnt, booked).area().count() < 1e-3) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format(
          "{}piece {} would be cut with a kerf of {:.2f} mm, wider than what is booked around it, or by another "
          "lead-in than is booked for it: plan the job again, or correct the recipe",
          material.empty() ? "" : material + " ", piece.mark, kerf.count())};
}

}  // namespace veneer::daemon
