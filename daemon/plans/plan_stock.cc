#include "daemon/plans/plan_stock.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/polygon_ops.h"
#include "daemon/stock/known_backs.h"

namespace veneer::daemon {
namespace {

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

// Nothing when its back was never scanned: it lies on the bed back up, where nobody would find it.
// What the plan `own` leases counts as free.
Result<std::optional<HeldPanel>> read_panel(Repositories& r, const db::PanelRecord& panel, const PanelLibrary& library,
                                            std::optional<db::PlanId> own) {
  HeldPanel out;
  out.id = panel.id;
  out.map = library.path_of(panel.map_file).string(), out.mask = library.path_of(panel.mask_file).string();
  const auto live = r.ledger.live_allocations(panel.id);
  if (!live) return live.error();
  out.remnant = panel.parent.has_value();
  for (const auto& allocation : *live) {
    if (!own || allocation.leased_to != *own) out.live.push_back(allocation.area);
    out.remnant |= allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
  }
  auto zones = r.materials.zones(panel.id);
  if (!zones) return zones.error();
  out.zones = std::move(*zones);
  const auto fiducials = r.panels.fiducials(panel.id);
  if (!fiducials) return fiducials.error();
  if (!to_calib(*fiducials).knows(Face::kBack)) return std::optional<HeldPanel>();
  out.spared = spared_by_leads(*fiducials);
  return std::optional(std::move(out));
}

// The versions of masks that a job's pieces were placed on, panel by panel: as the picture was planned, or as a panel
// was first taken in addition.
Result<std::map<PanelId, int>> versions_of(Repositories& r, const db::JobRecord& job) {
  std::map<PanelId, int> out;
  std::vector<db::PlanId> plans = {job.plan};
  auto redone = r.jobs.redos(job.id);
  if (!redone) return redone.error();
  plans.insert(plans.end(), redone->begin(), redone->end());
  for (const db::PlanId plan : plans) {
    const auto record = r.plans.find(plan);
    if (!record) return record.error();
    for (const db::PlannedPanel& panel : record->panels) out.emplace(panel.panel, panel.mask_version);
  }
  return out;
}

// The panel as the job knew it, whatever became of it: what was cut from it is a hole by now.
Status as_planned(Repositories& r, const PanelLibrary& library, JobId job, int version, HeldPanel& panel) {
  const auto masks = r.panels.masks(panel.id);
  if (!masks) return masks.error();
  const auto live = r.ledger.live_allocations(panel.id);
  if (!live) return live.error();
  panel.live.clear(), panel.own.clear();
  for (const auto& allocation : *live) (allocation.job == job ? panel.own : panel.live).push_back(allocation.area);
  panel.mask_now = library.path_of(masks->front().mask_file).string();
  for (const db::MaskRecord& mask : *masks)
    if (mask.version == version)
      panel.map = library.path_of(mask.map_file).string(), panel.mask = library.path_of(mask.mask_file).string();
  return Ok();
}

}  // namespace

Result<PlanStock> read_stock(Repositories& r, const std::vector<PanelId>& wanted, const PanelLibrary& library,
                             std::optional<db::PlanId> own) {
  const auto panels = r.panels.list();
  if (!panels) return panels.error();
  for (const auto& id : wanted) {
    const auto panel = std::find_if(panels->begin(), panels->end(), [&](const auto& p) { return p.id == id; });
    if (panel == panels->end())
      return Error{ErrorCode::kNotFound, fmt::format("there is no panel {}: see veneerctl panel list", id.value)};
    if (panel->retired)
      return Error{ErrorCode::kRefused,
                   fmt::format("panel {} was retired ({}): take another, or veneerctl panel restore {}", id.value,
                               panel->retired->reason, id.value)};
  }
  PlanStock out;
  for (const auto& panel : *panels) {
    if (!panel.retired) out.in_stock.push_back(panel.id);
    if (panel.retired || (!wanted.empty() && std::find(wanted.begin(), wanted.end(), panel.id) == wanted.end())) {
      out.not_used.insert(panel.id);
      continue;
    }
    auto held = read_panel(r, panel, library, own);
    if (!held) return held.error();
    const Status surface = r.facts.check_surface(panel.id);
    if (!surface && surface.error().code != ErrorCode::kRefused) return surface.error();
    if (!*held || !surface) {
      const std::string why = !*held ? scan_its_back(panel.id) : surface.error().message;
      if (!wanted.empty()) return Error{ErrorCode::kRefused, why};
      out.left_out.emplace_back(panel.id, why);
      out.not_used.insert(panel.id);
      continue;
    }
    out.held.push_back(std::move(**held));
    out.planned_on.push_back({panel.id, panel.mask_version});
  }
  if (out.held.empty() && !out.left_out.empty()) return Error{ErrorCode::kRefused, out.left_out.front().second};
  if (out.held.empty())
    return Error{ErrorCode::kRefused, "there is no panel in stock: scan one with veneerctl panel scan"};
  auto recipes = r.materials.recipes();
  if (!recipes) return recipes.error();
  out.recipes = std::move(*recipes);
  return out;
}

Status hold_as_planned(Repositories& r, const PanelLibrary& library, const db::JobRecord& job, PlanStock& stock) {
  auto versions = versions_of(r, job);
  if (!versions) return versions.error();
  for (HeldPanel& panel : stock.held) {
    const auto known = versions->find(panel.id);
    if (known == versions->end()) continue;
    if (Status held = as_planned(r, library, job.id, known->second, panel); !held) return held;
    versions->erase(known);
  }
  // Out of stock by now; its pieces are in the picture all the same.
  for (const auto& [id, version] : *versions) {
    HeldPanel& panel = stock.held.emplace_back();
    panel.id = id;
    panel.closed = true;
    auto zones = r.materials.zones(id);
    if (!zones) return zones.error();
    panel.zones = std::move(*zones);
    if (Status held = as_planned(r, library, job.id, version, panel); !held) return held;
  }
  return Ok();
}

}  // namespace veneer::daemon
