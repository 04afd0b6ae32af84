#include "daemon/plans/cut_file.h"

#include <cmath>

#include "drivers/lihuiyu/egv_encoder.h"

namespace veneer::daemon {
namespace {

Result<CutFile> write(const LaserJob& job, const Travel& travel, std::vector<std::string> warnings = {}) {
  const lihuiyu::MilGrid grid{travel.x.count(), travel.y.count()};
  if (const Status good = lihuiyu::check_job(job, grid); !good) return good.error();
  return CutFile{lihuiyu::write_egv(job, grid), std::move(warnings)};
}

}  // namespace

LaserJob job_of(const planner::TestCard& card, bool dark) {
  LaserJob job;
  for (const auto* strokes : {&card.labels, &card.fields})
    job.strokes.insert(job.strokes.end(), strokes->begin(), strokes->end());
  if (dark)
    for (Stroke& stroke : job.strokes) stroke.power = PowerFraction(0);
  return job;
}

Result<LayToolpath> path_from_home(const db::PanelRecord& panel, const std::vector<db::PieceRecord>& pieces,
                                   const WoodRecipes& recipes, const RecipeConfig& config, const Travel& travel) {
  // x = width - x, and the upper edge at the far end of the travel.
  const Isometry2<BedFrame, PanelFrame> bed_from_panel(Radians(0), {panel.width, travel.y - panel.height},
                                                       Handedness::kImproper);
  LayToolpath order;
  order.options = toolpath_options(config);
  order.options.start = {Millimetres(0), travel.y};
  for (const auto& piece : pieces) {
    if (piece.panel != panel.id) continue;
    const auto bed_from_artwork = bed_from_panel * piece.panel_from_artwork;
    const auto foot = bed_from_artwork * Point<ArtworkFrame>{}, head = bed_from_artwork * point<ArtworkFrame>(0, 1);
    planner::ToolpathPiece& p = order.pieces.emplace_back();
    p.piece = piece.id;
    p.outline = bed_from_panel * piece.panel_outline;
    p.mark = piece.mark;
    p.artwork_up = Radians(std::atan2((head.y - foot.y).count(), (head.x - foot.x).count()));
    p.recipe = recipes.recipe_of(recipes.material_at(piece.panel_outline));
    auto leads = leads_on_bed(piece, *p.recipe, order.options.fit_clearance, bed_from_panel);
    if (!leads) return leads.error();
    p.leads = std::move(*leads);
  }
  return order;
}

Result<CutFile> egv_of(const planner::Toolpath& path, const Travel& travel) {
  LaserJob job;
  for (const auto& from : path.strokes) {
    Stroke& stroke = job.strokes.emplace_back();
    stroke.piece = from.piece;
    stroke.role = from.role;
    for (const auto& p : from.path) stroke.path.push_back({p.x, p.y});
    stroke.speed = from.speed;
    stroke.power = from.power;
    stroke.passes = from.passes;
    stroke.air = from.air;
  }
  return write(job, travel, path.warnings);
}

Result<CutFile> egv_of(const planner::TestCard& card, const Travel& travel) { return write(job_of(card), travel); }

}  // namespace veneer::daemon
