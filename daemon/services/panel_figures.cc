#include "daemon/services/panel_figures.h"

#include <fmt/format.h>

#include <vector>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {

Result<double> PanelFigures::area_of(Repositories& r, db::AllocationId allocation) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = areas_.find(allocation.value); known != areas_.end()) return known->second;
  }
  const auto area = r.ledger.area_of(allocation);
  if (!area) return area.error();
  const std::lock_guard lock(mutex_);
  return areas_[allocation.value] = area->count();
}

Result<double> PanelFigures::free_of(Repositories& r, const db::PanelRecord& panel, const std::string& live) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = free_.find(panel.id); known != free_.end() && known->second.of == live)
      return known->second.area;
  }
  const auto allocations = r.ledger.live_allocations(panel.id);
  if (!allocations) return allocations.error();
  // No plan can use a panel whose mask cannot be read; the others are listed all the same.
  const auto mask = library_.load_mask(panel);
  if (!mask) return 0.0;
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(allocations->size());
  for (const auto& allocation : *allocations) areas.push_back(allocation.area);
  const double area = wood_area(free_wood(*mask, areas, Millimetres(0))).count();
  const std::lock_guard lock(mutex_);
  free_[panel.id] = {live, area};
  return area;
}

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel) {
  Figures figures;
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  std::string booked = panel.mask_file;
  for (const auto& [allocation, state] : *live) {
    const auto area = area_of(r, allocation);
    if (!area) return area.error();
    const bool gone = state == db::AllocationState::kCut || state == db::AllocationState::kScrap;
    (gone ? figures.cut : figures.reserved) += *area;
    ++figures.pieces;
    booked += fmt::format(" {}", allocation.value);
  }
  const auto fiducials = r.panels.fiducials(panel.id);
  if (!fiducials) return fiducials.error();
  for (const auto& f : *fiducials) figures.back_known |= f.face == Face::kBack;
  const auto scans = r.panels.scans(panel.id);
  if (!scans) return scans.error();
  if (!scans->empty()) figures.rms = scans->back().rms;
  const auto usable = library_.usable_area(panel);
  if (!usable) return usable.error();
  figures.usable = figures.free = usable->count();
  if (live->empty()) return figures;
  const auto free = free_of(r, panel, booked);
  if (!free) return free.error();
  figures.free = *free;
  return figures;
}

}  // namespace veneer::daemon
