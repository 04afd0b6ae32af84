#include "daemon/stock/panel_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {
namespace {

// The areas of so many allocations are kept, some 5 MB; and what each takes, some 100 KB a panel, of so many panels.
constexpr std::size_t kKeptAreas = 100'000, kKeptBooks = 32;

}  // namespace

Result<double> PanelFigures::area_of(Repositories& r, db::AllocationId allocation) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = areas_.find(allocation.value); known != areas_.end()) return known->second;
  }
  const auto area = r.ledger.area_of(allocation);
  if (!area) return area.error();
  const std::lock_guard lock(mutex_);
  if (areas_.size() >= kKeptAreas) areas_.clear();
  return areas_[allocation.value] = area->count();
}

// Wood may be booked or given back between any two questions that are not of one moment: what is counted is kept under
// the name of what it was counted of, or a lease that ends soon would leave a count without its wood for the panel that
// has it again.
Result<std::optional<PanelFigures::Free>> PanelFigures::free_of(Repositories& r, const db::PanelRecord& panel,
                                                                const std::string& wood) {
  if (const auto known = memory_.find(panel.id, "free", wood)) return std::optional(Free{known->at(0), wood});
  // No plan can use a panel whose mask cannot be read; the others are listed all the same.
  const auto mask = library_.load_mask(panel);
  if (!mask) return std::optional<Free>();
  const auto allocations = r.ledger.live_allocations(panel.id);
  if (!allocations) return allocations.error();
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(allocations->size());
  for (const auto& allocation : *allocations) areas.push_back(allocation.area);
  const Free free{wood_area(free_wood(*mask, areas, Millimetres(0))).count(),
                  StockMemory::name_of_wood(panel, *allocations)};
  memory_.keep_for_long(panel.id, "free", free.wood, {free.area});
  return std::optional(free);
}

Result<PanelFigures::Wood> PanelFigures::wood_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest) {
  const auto state = memory_.state_of(r, panel, newest);
  if (!state) return state.error();
  if (const auto known = memory_.find(panel.id, "booked", state->booked))
    return Wood{known->at(0), known->at(1), known->at(2), static_cast<int>(known->at(3))};
  Wood wood;
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  for (const auto& [allocation, state_now] : *live) {
    const auto area = area_of(r, allocation);
    if (!area) return area.error();
    const bool gone = state_now == db::AllocationState::kCut || state_now == db::AllocationState::kScrap;
    (gone ? wood.cut : wood.reserved) += *area;
    ++wood.pieces;
  }
  const StockMemory::State counted = StockMemory::name_of(panel, *live);
  bool of_one_moment = true;
  if (!live->empty()) {
    const auto free = free_of(r, panel, counted.wood);
    if (!free) return free.error();
    if (!*free) return wood;
    wood.free = (*free)->area;
    of_one_moment = (*free)->wood == counted.wood;
  }
  if (of_one_moment)
    memory_.keep(panel.id, "booked", counted.booked,
                 {wood.free, wood.reserved, wood.cut, static_cast<double>(wood.pieces)});
  return wood;
}

Result<double> PanelFigures::free(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = memory_.newest_step(r);
  return newest ? free(r, panel, *newest) : Result<double>(newest.error());
}

Result<double> PanelFigures::free(Repositories& r, const db::PanelRecord& panel, std::int64_t newest) {
  const auto wood = wood_of(r, panel, newest);
  if (!wood) return wood.error();
  if (wood->pieces > 0) return wood->free;
  const auto usable = library_.usable_area(panel);
  if (!usable) return usable.error();
  return usable->count();
}

Status PanelFigures::count(Repositories& r, const db::PanelRecord& panel, std::int64_t newest) {
  const auto wood = wood_of(r, panel, newest);
  if (!wood) return wood.error();
  const auto usable = library_.usable_area(panel);
  return usable ? Ok() : Status(usable.error());
}

Result<PanelFigures::Asked> PanelFigures::ask(Repositories& r) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  auto summaries = r.panels.summaries();
  if (!summaries) return summaries.error();
  return Asked{*newest, std::move(*summaries)};
}

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  auto summary = r.panels.summaries(panel.id);
  if (!summary) return summary.error();
  return of(r, panel, Asked{*newest, std::move(*summary)});
}

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel, const Asked& asked) {
  Figures figures;
  const auto wood = wood_of(r, panel, asked.newest);
  if (!wood) return wood.error();
  figures.free = wood->free, figures.reserved = wood->reserved, figures.cut = wood->cut;
  figures.pieces = wood->pieces;
  const auto summary = asked.summaries.find(panel.id);
  if (summary == asked.summaries.end())
    return Error{ErrorCode::kNotFound, fmt::format("there is no panel {}: see veneerctl panel list", panel.id.value)};
  figures.open_differences = summary->second.open_differences;
  figures.back_known = summary->second.back_known;
  figures.rms = summary->second.rms;
  const auto usable = library_.usable_area(panel);
  if (!usable) return usable.error();
  figures.usable = usable->count();
  if (wood->pieces == 0) figures.free = figures.usable;
  return figures;
}

// The one that was kept for this mask; else one without a mask.
PanelFigures::Booked PanelFigures::booked_on(const db::PanelRecord& panel) {
  const std::lock_guard lock(mutex_);
  const auto known =
      std::find_if(booked_.begin(), booked_.end(), [&](const auto& entry) { return entry.first == panel.id; });
  if (known == booked_.end() || known->second.mask_file != panel.mask_file) return {};
  booked_.splice(booked_.begin(), booked_, known);
  return known->second;
}

void PanelFigures::keep_booked(const PanelId& panel, const Booked& booked) {
  const std::lock_guard lock(mutex_);
  booked_.remove_if([&](const auto& entry) { return entry.first == panel; });
  booked_.emplace_front(panel, booked);
  if (booked_.size() > kKeptBooks) booked_.pop_back();
}

Result<bool> PanelFigures::knows(Repositories& r, const db::PanelRecord& panel) {
  const auto state = memory_.state_of(r, panel);
  if (!state) return state.error();
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  const Booked booked = booked_on(panel);
  const auto known = [&](const auto& entry) { return booked.wood.contains(entry.first.value); };
  return !booked.mask_file.empty() && std::all_of(live->begin(), live->end(), known) &&
         (live->empty() || memory_.find(panel.id, "free", state->wood).has_value());
}

Result<std::optional<AreaBook>> PanelFigures::book(Repositories& r, const db::PanelRecord& panel) {
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  Booked booked = booked_on(panel);
  const auto whole = whole_panel(panel.width, panel.height);
  const auto unknown = [&](const auto& entry) { return !booked.wood.contains(entry.first.value); };
  if (booked.mask_file.empty() || std::any_of(live->begin(), live->end(), unknown)) {
    const auto allocations = r.ledger.live_allocations(panel.id);
    if (!allocations) return allocations.error();
    const auto mask = library_.load_mask(panel);
    if (!mask) return std::optional<AreaBook>();
    if (booked.mask_file.empty())
      booked.mask_file = panel.mask_file, booked.panel = masked_panel(*mask, panel.width, panel.height);
    for (const auto& allocation : *allocations)
      if (!booked.wood.contains(allocation.id.value))
        booked.wood.emplace(allocation.id.value, booked_wood(allocation, *mask, whole));
    keep_booked(panel.id, booked);
  }
  AreaBook book = opened(whole, booked.panel);
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
