#include "daemon/stock/panel_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {
namespace {

// The areas of so many allocations are kept, some 5 MB; and what each takes, some 100 KB a panel, of so many panels.
constexpr std::size_t kKeptAreas = 100'000, kKeptBooks = 32;

// What the stock's memory keeps as "wood": pieces, reserved, cut, free, and the book.
constexpr std::array kBookFields = {&AreaBook::panel, &AreaBook::free,    &AreaBook::reserved, &AreaBook::cut,
                                    &AreaBook::kerf,  &AreaBook::suspect, &AreaBook::scrap,    &AreaBook::unusable};

}  // namespace

const char* to_string(MaskCount count) {
  switch (count) {
    case MaskCount::kCounted:
      return "counted";
    case MaskCount::kUncounted:
      return "uncounted";
    case MaskCount::kUnreadable:
      return "unreadable";
  }
  return "uncounted";
}

// A panel's mask, read once for all that is counted of it, and only if something is.
class PanelFigures::Mask {
 public:
  Mask(const PanelLibrary& library, StockMemory& memory, const db::PanelRecord& panel, Look look)
      : library_(library), memory_(memory), panel_(panel), look_(look) {}

  // Null when it cannot be read, or is not to be looked at.
  const Raster<PanelFrame>* read() {
    if (look_ == Look::kMay && !std::exchange(looked_, true)) {
      auto mask = library_.load_mask(panel_);
      memory_.note_readable(panel_.mask_file, mask.ok());
      if (mask) mask_ = std::move(*mask);
    }
    return mask_ ? &*mask_ : nullptr;
  }
  bool looked() const { return looked_; }

 private:
  const PanelLibrary& library_;
  StockMemory& memory_;
  const db::PanelRecord& panel_;
  const Look look_;
  bool looked_ = false;
  std::optional<Raster<PanelFrame>> mask_;
};

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

std::vector<double> PanelFigures::to_numbers(const Wood& wood) {
  std::vector<double> out = {static_cast<double>(wood.pieces), wood.reserved, wood.cut, *wood.free};
  for (const auto field : kBookFields) out.push_back(((*wood.book).*field).count());
  return out;
}

PanelFigures::Wood PanelFigures::kept_wood(const std::vector<double>& numbers) {
  Wood wood;
  wood.pieces = static_cast<int>(numbers[0]), wood.reserved = numbers[1], wood.cut = numbers[2];
  wood.free = numbers[3], wood.book.emplace();
  std::size_t at = 4;
  for (const auto field : kBookFields) (*wood.book).*field = SquareMillimetres(numbers[at++]);
  return wood;
}

// Of masks older than schema 8 nobody wrote it down.
Result<std::optional<double>> PanelFigures::usable_of(const db::PanelRecord& panel, Mask& mask) {
  if (panel.usable) return std::optional(panel.usable->count());
  if (const auto known = memory_.find(panel.id, "usable", panel.mask_file)) return std::optional(known->at(0));
  const auto* pixels = mask.read();
  if (pixels == nullptr) return std::optional<double>();
  const double usable = wood_area(*pixels).count();
  memory_.keep_for_long(panel.id, "usable", panel.mask_file, {usable});
  return std::optional(usable);
}

// Wood may be booked or given back between any two questions that are not of one moment: what is counted is kept under
// the name of what it was counted of, or a lease that ends soon would leave a count without its wood for the panel that
// has it again.
Result<std::optional<PanelFigures::Free>> PanelFigures::free_of(Repositories& r, const db::PanelRecord& panel,
                                                                const std::string& wood, Mask& mask) {
  if (const auto known = memory_.find(panel.id, "free", wood)) return std::optional(Free{known->at(0), wood});
  const auto* pixels = mask.read();
  if (pixels == nullptr) return std::optional<Free>();
  const auto allocations = r.ledger.live_allocations(panel.id);
  if (!allocations) return allocations.error();
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(allocations->size());
  for (const auto& allocation : *allocations) areas.push_back(allocation.area);
  const Free free{wood_area(free_wood(*pixels, areas, Millimetres(0))).count(),
                  StockMemory::name_of_wood(panel, *allocations)};
  memory_.keep_for_long(panel.id, "free", free.wood, {free.area});
  return std::optional(free);
}

Result<PanelFigures::Wood> PanelFigures::wood_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest,
                                                 Look look) {
  const auto state = memory_.state_of(r, panel, newest);
  if (!state) return state.error();
  Mask mask(library_, memory_, panel, look);
  if (const auto known = memory_.find(panel.id, "wood", state->booked);
      known && known->size() == 4 + kBookFields.size())
    return kept_wood(*known);
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
  auto book = book_of(r, panel, *live, mask);
  if (!book) return book.error();
  wood.book = *book;
  bool of_one_moment = true;
  if (live->empty()) {
    const auto usable = usable_of(panel, mask);
    if (!usable) return usable.error();
    wood.free = *usable;
  } else {
    const auto free = free_of(r, panel, counted.wood, mask);
    if (!free) return free.error();
    if (*free) wood.free = (*free)->area, of_one_moment = (*free)->wood == counted.wood;
  }
  if (!wood.book || !wood.free || !of_one_moment) return wood;
  if (mask.looked())
    memory_.keep_for_long(panel.id, "wood", counted.booked, to_numbers(wood));
  else
    memory_.keep(panel.id, "wood", counted.booked, to_numbers(wood));
  return wood;
}

MaskCount PanelFigures::counted(const db::PanelRecord& panel, const Wood& wood) {
  if (wood.book && wood.free) return MaskCount::kCounted;
  return memory_.is_readable(panel.mask_file) ? MaskCount::kUncounted : MaskCount::kUnreadable;
}

Result<double> PanelFigures::free(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  const auto known = free(r, panel, *newest, Look::kMay);
  return known ? known->value_or(0) : Result<double>(known.error());
}

Result<std::optional<double>> PanelFigures::free(Repositories& r, const db::PanelRecord& panel, std::int64_t newest,
                                                 Look look) {
  const auto wood = wood_of(r, panel, newest, look);
  if (!wood) return wood.error();
  return counted(panel, *wood) == MaskCount::kUnreadable ? std::optional<double>() : wood->free;
}

Result<MaskCount> PanelFigures::count(Repositories& r, const db::PanelRecord& panel, std::int64_t newest, Look look) {
  const auto wood = wood_of(r, panel, newest, look);
  if (!wood) return wood.error();
  return counted(panel, *wood);
}

Result<bool> PanelFigures::knows(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  const auto known = count(r, panel, *newest, Look::kNot);
  return known ? *known == MaskCount::kCounted : Result<bool>(known.error());
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
  return of(r, panel, Asked{*newest, std::move(*summary)}, Look::kMay);
}

Result<PanelFigures::Figures> PanelFigures::of(Repositories& r, const db::PanelRecord& panel, const Asked& asked,
                                               Look look) {
  const auto summary = asked.summaries.find(panel.id);
  if (summary == asked.summaries.end())
    return Error{ErrorCode::kNotFound, fmt::format("there is no panel {}: see veneerctl panel list", panel.id.value)};
  const auto wood = wood_of(r, panel, asked.newest, look);
  if (!wood) return wood.error();
  Figures figures;
  figures.mask = counted(panel, *wood);
  figures.book = figures.mask == MaskCount::kCounted ? wood->book : std::nullopt;
  figures.free = figures.mask == MaskCount::kUnreadable ? std::nullopt : wood->free;
  figures.reserved = wood->reserved, figures.cut = wood->cut;
  figures.pieces = wood->pieces;
  figures.open_differences = summary->second.open_differences;
  figures.back_known = summary->second.back_known;
  figures.rms = summary->second.rms;
  Mask mask(library_, memory_, panel, look);
  const auto usable = usable_of(panel, mask);
  if (!usable) return usable.error();
  figures.usable = *usable;
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

Result<std::optional<AreaBook>> PanelFigures::book(Repositories& r, const db::PanelRecord& panel) {
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  Mask mask(library_, memory_, panel, Look::kMay);
  return book_of(r, panel, *live, mask);
}

Result<std::optional<AreaBook>> PanelFigures::book_of(Repositories& r, const db::PanelRecord& panel, const Live& live,
                                                      Mask& mask) {
  Booked booked = booked_on(panel);
  const auto whole = whole_panel(panel.width, panel.height);
  const auto unknown = [&](const auto& entry) { return !booked.wood.contains(entry.first.value); };
  if (booked.mask_file.empty() || std::any_of(live.begin(), live.end(), unknown)) {
    const auto* pixels = mask.read();
    if (pixels == nullptr) return std::optional<AreaBook>();
    const auto allocations = r.ledger.live_allocations(panel.id);
    if (!allocations) return allocations.error();
    if (booked.mask_file.empty())
      booked.mask_file = panel.mask_file, booked.panel = masked_panel(*pixels, panel.width, panel.height);
    for (const auto& allocation : *allocations)
      if (!booked.wood.contains(allocation.id.value))
        booked.wood.emplace(allocation.id.value, booked_wood(allocation, *pixels, whole));
    keep_booked(panel.id, booked);
  }
  AreaBook book = opened(whole, booked.panel);
  for (const auto& [allocation, state] : live) {
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
