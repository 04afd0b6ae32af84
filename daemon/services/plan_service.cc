#include "daemon/services/plan_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/hash.h"
#include "daemon/services/calibration.h"
#include "daemon/services/job_wood.h"
#include "daemon/services/wood_recipes.h"
#include "planner/cutting/lead_choice.h"
#include "planner/files/plan_files.h"
#include "planner/files/preview.h"
#include "planner/pictures/pictures.h"
#include "planner/problem/shortage.h"

namespace veneer::daemon {
namespace {

// As fine as the veneer maps: a coarser one blurs the grain that people look for.
constexpr double kPreviewDpi = 300;

std::vector<db::NewPiece> pieces_of(const planner::Plan& plan) {
  std::vector<db::NewPiece> out;
  for (const auto& piece : plan.pieces) {
    db::NewPiece& p = out.emplace_back();
    p.mark = piece.mark;
    p.artwork_outline = piece.artwork_outline;
    if (!piece.placement) continue;
    p.panel = piece.placement->panel;
    p.panel_outline = piece.panel_outline();
    p.panel_from_artwork = piece.placement->panel_from_artwork;
    p.allocation = offset(Region<PanelFrame>(piece.panel_outline()), plan.kerf);
  }
  return out;
}

std::vector<db::PlannedPanel> panels_used(std::vector<db::PlannedPanel> in_stock,
                                          const std::vector<db::NewPiece>& pieces) {
  std::erase_if(in_stock, [&](const db::PlannedPanel& p) {
    return std::none_of(pieces.begin(), pieces.end(),
                        [&](const db::NewPiece& piece) { return piece.panel == p.panel; });
  });
  return in_stock;
}

// What stays whole even where no piece lies: a tag with its white border, a hole's rim.
std::vector<Region<PanelFrame>> spared_by_leads(const std::vector<db::FiducialRecord>& fiducials) {
  constexpr Millimetres kRim(4);
  std::vector<Region<PanelFrame>> out;
  for (const auto& fiducial : fiducials) {
    if (fiducial.corners.size() == 4) {
      const Millimetres module = distance(fiducial.corners[0], fiducial.corners[1]) / 8;
      out.push_back(offset(Region<PanelFrame>(fiducial.corners), 2 * module));
    } else if (!fiducial.corners.empty()) {
      const auto& c = fiducial.corners.front();
      out.emplace_back(Ring<PanelFrame>{
          {c.x - kRim, c.y - kRim}, {c.x + kRim, c.y - kRim}, {c.x + kRim, c.y + kRim}, {c.x - kRim, c.y + kRim}});
    }
  }
  return out;
}

}  // namespace

PlanService::PlanService(DatabaseThread& database, const PanelLibrary& library, const RecipeConfig& recipe,
                         Millimetres position_margin, Logger log)
    : database_(database),
      library_(library),
      recipe_(recipe),
      position_margin_(position_margin),
      log_(std::move(log)) {}

Result<std::string> PlanService::preview_file(JobId job) {
  auto record = database_.call([&](Repositories& r) { return r.jobs.find(job); });
  if (!record) return record.error();
  return record->preview_file;
}

Result<std::size_t> PlanService::add_leads(const planner::Plan& plan, const std::vector<planner::StockPanel>& stock,
                                           Millimetres kerf, std::vector<db::NewPiece>& pieces) {
  const planner::ToolpathOptions options = toolpath_options(recipe_);
  std::size_t without = 0;
  for (const auto& panel : stock) {
    if (options.leads.length.count() <= 0) break;
    auto room = database_.call([&](Repositories& r) -> Result<planner::LeadRoom> {
      auto fiducials = r.panels.fiducials(panel.id);
      if (!fiducials) return fiducials.error();
      return planner::LeadRoom{panel.free, spared_by_leads(*fiducials), plan.kerf};
    });
    if (!room) return room.error();
    auto recipes = database_.call([&](Repositories& r) { return WoodRecipes::read(r, recipe_, kerf, panel.id); });
    if (!recipes) return recipes.error();
    std::vector<db::NewPiece*> on_panel;
    std::vector<planner::LeadPiece> to_lead;
    for (auto& piece : pieces) {
      if (piece.panel != panel.id) continue;
      on_panel.push_back(&piece);
      to_lead.push_back({piece.panel_outline, piece.mark, piece.panel_from_artwork.angle() + Radians(kPi / 2),
                         recipes->recipe_of(recipes->material_at(piece.panel_outline)), piece.allocation});
    }
    const auto leads = planner::choose_leads(to_lead, *room, options);
    if (!leads) return leads.error();
    for (std::size_t i = 0; i < on_panel.size(); ++i) {
      if (const auto& lead = (*leads)[i]) {
        on_panel[i]->lead_in = lead->begin;
        on_panel[i]->allocation = unite(on_panel[i]->allocation, lead->burnt);
      } else {
        ++without;
      }
    }
  }
  return without;
}

Result<JobOutcome> PlanService::make_job(const JobRequest& request, const TaskProgress& progress,
                                         const std::stop_token& stop) {
  progress(0, "reading the picture");
  auto picture = planner::decode_picture(request.picture, request.name);
  if (!picture) return picture.error();
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (!calibration->kerf)
    return Error{ErrorCode::kRefused,
                 "the kerf is not known: lay the burnt board on the scanner and run veneerctl calibrate kerf"};
  progress(0.02, "reading the stock");
  // Asked before the masks are read: a panel that is scanned in between is noticed when its wood is reserved.
  auto planned_on = database_.call([](Repositories& r) -> Result<std::vector<db::PlannedPanel>> {
    auto panels = r.panels.list();
    if (!panels) return panels.error();
    std::vector<db::PlannedPanel> out;
    for (const auto& panel : *panels) out.push_back({panel.id, panel.mask_version});
    return out;
  });
  if (!planned_on) return planned_on.error();
  auto stock = load_job_wood(database_, library_, request, position_margin_);
  if (!stock) return stock.error();

  planner::Artwork artwork;
  artwork.name = request.name;
  artwork.letter = planner::artwork_letter(0);
  const auto size = planner::artwork_size(*picture, request.size);
  artwork.picture = std::move(*picture);
  artwork.width = size.width;
  artwork.height = size.height;
  planner::PlanOptions options = request.options;
  // One kerf for the whole plan: the widest any of the wood is cut with.
  auto widest = database_.call([&](Repositories& r) -> Result<Millimetres> {
    Millimetres kerf = *calibration->kerf;
    for (const auto& panel : *stock) {
      auto recipes = WoodRecipes::read(r, {}, kerf, panel.id);
      if (!recipes) return recipes.error();
      kerf = std::max(kerf, recipes->widest_kerf());
    }
    return kerf;
  });
  if (!widest) return widest.error();
  options.kerf = *widest;
  options.index_cache = library_.index_dir().string();
  auto plan = planner::make_plan(
      {&artwork, 1}, *stock, options,
      [&](double f, std::string_view text) { progress(0.05 + 0.83 * f, std::string(text)); }, stop);
  if (!plan) return plan.error();
  // A global choice that is stopped still gives a plan; whoever cancels a job wants none.
  const Error cancelled{ErrorCode::kCancelled, "planning was cancelled"};
  if (stop.stop_requested()) return cancelled;
  if (plan->shortage)
    return Error{ErrorCode::kRefused,
                 "nothing is reserved: " + planner::sentence_of(*plan->shortage, plan->pieces.size())};

  progress(0.9, "drawing the preview");
  auto preview = planner::assemble_preview(*plan, 0, *stock, ScanResolution::from_dpi(kPreviewDpi));
  if (!preview) return preview.error();
  auto preview_file = library_.store_picture(preview->pixels, "previews", "preview");
  if (!preview_file) return preview_file.error();
  const auto hash = sha256_hex(std::as_bytes(std::span(request.picture)));
  auto target_file = library_.store_bytes(request.picture, "targets", hash.substr(0, 16));
  if (!target_file) return target_file.error();

  progress(0.95, "reserving the wood");
  db::NewJob job;
  job.name = request.name;
  job.target_file = target_file->file;
  job.preview_file = preview_file->file;
  job.plan_json = planner::plan_to_json(*plan);
  nlohmann::json used = options_json(request);
  used["preview_dpi"] = kPreviewDpi;
  used["kerf_mm"] = options.kerf.count();
  used["position_margin_mm"] = position_margin_.count();
  job.options_json = used.dump();
  job.pieces = pieces_of(*plan);
  job.planned_on = panels_used(*planned_on, job.pieces);
  const auto without_lead = add_leads(*plan, *stock, *calibration->kerf, job.pieces);
  if (!without_lead) return without_lead.error();
  if (stop.stop_requested()) return cancelled;
  auto id = database_.call([&](Repositories& r) { return r.jobs.create(job, utc_timestamp(), request.keyed); });
  if (!id) return id.error();

  JobOutcome outcome;
  outcome.job = *id;
  outcome.pieces = plan->pieces.size();
  outcome.without_lead = *without_lead;
  outcome.cost_per_pixel = planner::cost_per_pixel(*plan);
  std::map<PanelId, std::size_t> count;
  for (const auto& piece : plan->pieces)
    if (piece.placement) ++count[piece.placement->panel];
  outcome.panels.assign(count.begin(), count.end());
  outcome.warnings = plan->warnings;
  outcome.global = plan->global;
  outcome.fine = plan->fine;
  log_->info("job {} ({}): {} pieces reserved", id->value, request.name, outcome.pieces);
  if (outcome.without_lead > 0)
    log_->info("{} of them lie too close to others for a lead-in: their cuts begin on their edges",
               outcome.without_lead);
  return outcome;
}

}  // namespace veneer::daemon
