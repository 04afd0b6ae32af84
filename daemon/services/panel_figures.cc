#include "daemon/services/panel_figures.h"

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

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel) {
  Figures figures;
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  for (const auto& [allocation, state] : *live) {
    const auto area = area_of(r, allocation);
    if (!area) return area.error();
    const bool gone = state == db::AllocationState::kCut || state == db::AllocationState::kScrap;
    (gone ? figures.cut : figures.reserved) += *area;
    ++figures.pieces;
  }
  const auto fiducials = r.panels.fiducials(panel.id);
  if (!fiducials) return fiducials.error();
  for (const auto& f : *fiducials) figures.back_known |= f.face == Face::kBack;
  const auto scans = r.panels.scans(panel.id);
  if (!scans) return scans.error();
  if (!scans->empty()) figures.rms = scans->back().rms;
  const auto usable = library_.usable_area(panel);
  if (!usable) return usable.error();
  figures.usable = usable->count();
  return figures;
}

}  // namespace veneer::daemon
