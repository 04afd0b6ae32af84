#include "daemon/services/panel_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
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

Result<std::optional<double>> PanelFigures::free_of(Repositories& r, const db::PanelRecord& panel,
                                                    const std::string& live) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = free_.find(panel.id); known != free_.end() && known->second.of == live)
      return std::optional(known->second.area);
  }
  const auto allocations = r.ledger.live_allocations(panel.id);
  if (!allocations) return allocations.error();
  // No plan can use a panel whose mask cannot be read; the others are listed all the same.
  const auto mask = library_.load_mask(panel);
  if (!mask) return std::optional<double>();
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(allocations->size());
  for (const auto& allocation : *allocations) areas.push_back(allocation.area);
  const double area = wood_area(free_wood(*mask, areas, Millimetres(0))).count();
  const std::lock_guard lock(mutex_);
  free_[panel.id] = {live, area};
  return std::optional(area);
}

// The newest step that `r` sees. Each reader may see another one: what is counted now is as old as this.
Result<std::int64_t> PanelFigures::note_changes(Repositories& r) {
  std::int64_t seen = 0;
  {
    const std::lock_guard lock(mutex_);
    seen = seen_;
  }
  const auto changes = r.ledger.changes_after(seen);
  if (!changes) return changes.error();
  const std::lock_guard lock(mutex_);
  seen_ = std::max(seen_, changes->newest);
  for (const PanelId& panel : changes->panels) changed_[panel] = std::max(changed_[panel], changes->newest);
  return changes->newest;
}

Result<PanelFigures::Wood> PanelFigures::wood_of(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = note_changes(r);
  if (!newest) return newest.error();
  {
    const std::lock_guard lock(mutex_);
    const auto known = wood_.find(panel.id);
    if (known != wood_.end() && known->second.mask_file == panel.mask_file &&
        known->second.counted_at >= changed_[panel.id])
      return known->second;
  }
  Wood wood;
  wood.mask_file = panel.mask_file;
  wood.counted_at = *newest;
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  std::string booked = panel.mask_file;
  for (const auto& [allocation, state] : *live) {
    const auto area = area_of(r, allocation);
    if (!area) return area.error();
    const bool gone = state == db::AllocationState::kCut || state == db::AllocationState::kScrap;
    (gone ? wood.cut : wood.reserved) += *area;
    ++wood.pieces;
    booked += fmt::format(" {}", allocation.value);
  }
  if (!live->empty()) {
    const auto free = free_of(r, panel, booked);
    if (!free) return free.error();
    if (!*free) return wood;
    wood.free = **free;
  }
  const std::lock_guard lock(mutex_);
  return wood_[panel.id] = wood;
}

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel) {
  Figures figures;
  const auto wood = wood_of(r, panel);
  if (!wood) return wood.error();
  figures.free = wood->free, figures.reserved = wood->reserved, figures.cut = wood->cut;
  figures.pieces = wood->pieces;
  const auto differences = r.differences.open(panel.id);
  if (!differences) return differences.error();
  figures.open_differences = *differences;
  const auto fiducials = r.panels.fiducials(panel.id);
  if (!fiducials) return fiducials.error();
  for (const auto& f : *fiducials) figures.back_known |= f.face == Face::kBack;
  const auto scans = r.panels.scans(panel.id);
  if (!scans) return scans.error();
  if (!scans->empty()) figures.rms = scans->back().rms;
  const auto usable = library_.usable_area(panel);
  if (!usable) return usable.error();
  figures.usable = usable->count();
  if (wood->pieces == 0) figures.free = figures.usable;
  return figures;
}

Result<std::optional<AreaBook>> PanelFigures::book(Repositories& r, const db::PanelRecord& panel) {
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  Booked booked;
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = booked_.find(panel.id); known != booked_.end() && known->second.mask_file == panel.mask_file)
      booked = known->second;
  }
  const auto whole = whole_panel(panel.width, panel.height);
  const auto unknown = [&](const auto& entry) { return !booked.wood.contains(entry.first.value); };
  if (booked.mask_file.empty() || std::any_of(live->begin(), live->end(), unknown)) {
    const auto allocations = r.ledger.live_allocations(panel.id);
    if (!allocations) return allocations.error();
    const auto mask = library_.load_mask(panel);
    if (!mask) return std::optional<AreaBook>();
    if (booked.mask_file.empty())
      booked.mask_file = panel.mask_file, booked.usable = usable_of_panel(*mask, panel.width, panel.height);
    for (const auto& allocation : *allocations)
      if (!booked.wood.contains(allocation.id.value))
        booked.wood.emplace(allocation.id.value, booked_wood(allocation, *mask, whole));
    const std::lock_guard lock(mutex_);
    booked_[panel.id] = booked;
  }
  AreaBook book = opened(whole, booked.usable);
  for (const auto& [allocation, state] : *live) {
    const auto wood = booked.wood.find(allocation.value);
    if (wood == booked.wood.end())
      return Error{
          ErrorCode::kConflict,
          fmt::format("the wood of panel {} was being booked while it was counted: ask again", panel.id.value)};
    enter(book, wood->second, state);
  }
  return std::optional(book);
}

}  // namespace veneer::daemon
