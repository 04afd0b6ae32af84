// Panels: written off, out of stock and back, sawn apart, and two that turn out to be one sheet.
#pragma once

#include "tests/db/modelled_work.h"

namespace veneer::db {

class ModelledPanels : public ModelledWork {
 protected:
  void write_off() {
    ModelPiece wood;
    wood.panel = any_panel();
    wood.cells = random_cells();
    wood.state = AllocationState::kScrap;
    const bool allowed = !known_[wood.panel].retired && !taken(wood.panel, wood.cells, {}, kNow);
    const Status done = cell_.ledger().write_off(panels_[wood.panel], area_of(wood.cells), "a knot", kNow);
    RC_ASSERT(done.ok() == allowed);
    if (!allowed) return RC_ASSERT(done.error().code == ErrorCode::kConflict);
    ruined_.push_back(wood);
    expire(kNow);
  }
  // What of the middle of a cell nothing is booked on: all of it, or nothing.
  void write_off_free() {
    ModelPiece box;
    box.panel = any_panel();
    box.cells = {{*in_range(0, kGrid), *in_range(0, kGrid)}};
    box.state = AllocationState::kScrap;
    const auto& [x, y] = *box.cells.begin();
    const auto place = square(x * kCell + kInset, y * kCell + kInset, kCell - 2 * kInset);
    const bool adds = !taken(box.panel, box.cells, {}, kNever);
    const auto done =
        cell_.ledger().write_off_free(panels_[box.panel], Region<PanelFrame>(place), "a scorched rim", kLater);
    RC_ASSERT(done.ok() == !(adds && known_[box.panel].retired));
    if (!done.ok()) return;
    RC_ASSERT(done->count() == (adds ? (kCell - 2 * kInset) * (kCell - 2 * kInset) : 0));
    if (adds) written_off_.push_back(box);
    expire(kLater);
    for (ModelPlan& plan : plans_)
      if (plan.leases(box.panel, box.cells, kEver)) plan.lease.reset();
  }
  void retire_or_restore() {
    const int panel = any_panel();
    ModelPanel& known = known_[panel];
    if (*in_range(0, 3) != 0) {
      const bool allowed = known.retired && !known.has_part && !known.merged;
      RC_ASSERT(cell_.panels().restore(panels_[panel], "glued", kLater).ok() == allowed);
      if (allowed) known.retired = known.sawn = false;
      return;
    }
    const bool allowed = !known.retired && !is_held(panel, kLater);
    RC_ASSERT(cell_.panels().retire(panels_[panel], "split", kLater, "local:1000").ok() == allowed);
    known.retired = known.retired || allowed;
    if (allowed) expire(kLater);
  }
  void saw_apart() {
    const auto can_be = [&](int panel) {
      return !known_[panel].retired && !(run_ && run_->panel == panel) && !is_held(panel, kLater);
    };
    // Most panels hold something: where one can be sawn it mostly is.
    std::vector<int> whole;
    for (int panel = 0; panel < static_cast<int>(panels_.size()); ++panel)
      if (can_be(panel)) whole.push_back(panel);
    const bool any = whole.empty() || *in_range(0, 4) == 0;
    const int panel = any ? any_panel() : *rc::gen::elementOf(whole);
    ModelPanel& known = known_[panel];
    const bool allowed = can_be(panel);
    const Status sawn = cell_.panels().split(panels_[panel], "local:1000", "sawn apart", kLater);
    RC_ASSERT(sawn.ok() == allowed);
    if (!allowed) return RC_ASSERT(sawn.error().code == ErrorCode::kConflict);
    known.retired = known.sawn = true;
    expire(kLater);
  }
  // What lay some columns to the right in the parent; what is gone there is gone here, too.
  void enter_part() {
    if (panels_.size() == kMostPanels) return saw_apart();
    std::vector<int> sawn;
    for (int panel = 0; panel < static_cast<int>(panels_.size()); ++panel)
      if (known_[panel].sawn) sawn.push_back(panel);
    const int parent = sawn.empty() ? any_panel() : *rc::gen::elementOf(sawn);
    const int columns = *in_range(0, kGrid);
    PanelRecord part = sheet(must(cell_.panels().next_panel_id()));
    part.parent = panels_[parent];
    std::vector<ModelPiece> gone = ruined_, boxes = written_off_;
    bool doubtful = false;
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces) {
        if (piece.state == AllocationState::kCut || piece.state == AllocationState::kScrap) gone.push_back(piece);
        doubtful = doubtful || (piece.panel == parent && piece.state == AllocationState::kSuspect);
      }
    const bool allowed = known_[parent].sawn && !known_[parent].merged && !doubtful;
    const Isometry2<PanelFrame, PanelFrame> part_from_parent(Radians(0), point<PanelFrame>(-columns * kCell, 0));
    const Status entered = cell_.panels().add_part(part, {}, {}, {part_from_parent, 3, 0.02_mm});
    RC_ASSERT(entered.ok() == allowed);
    if (!allowed) return RC_ASSERT(entered.error().code == ErrorCode::kConflict);
    const int here = static_cast<int>(panels_.size());
    ModelPanel& known = know_panel(part.id);
    known.is_part = true, known.treated = known_[parent].treated;
    known_[parent].has_part = true;
    for (auto* wood : {&gone, &boxes})
      for (const ModelPiece& was : *wood) {
        if (was.panel != parent) continue;
        ModelPiece carried;
        carried.panel = here, carried.state = was.state;
        carried.carried_outline = Cell{was.outline_cell().first - columns, was.outline_cell().second};
        for (const auto& [x, y] : was.cells)
          if (x >= columns) carried.cells.insert({x - columns, y});
        if (!carried.cells.empty()) (wood == &gone ? ruined_ : written_off_).push_back(carried);
      }
  }
  std::vector<ModelPiece> wood_of(int panel) const {
    std::vector<ModelPiece> out;
    const auto add = [&](const ModelPiece& wood) {
      if (wood.panel == panel && wood.state != AllocationState::kReleased) out.push_back(wood);
    };
    for (const ModelJob& job : jobs_) std::for_each(job.pieces.begin(), job.pieces.end(), add);
    std::for_each(ruined_.begin(), ruined_.end(), add);
    std::for_each(written_off_.begin(), written_off_.end(), add);
    return out;
  }
  // Two records of one sheet: the wood of `merged`, some columns to the right, is that of `kept`.
  void merge() {
    const int kept = any_panel(), merged = any_panel();
    int columns = *in_range(0, 3);
    // Of a part, pieces may lie in it half; where wood would leave the grid, nothing is moved.
    if (known_[merged].is_part) return;
    for (const auto& wood : wood_of(merged))
      for (const auto& [x, y] : wood.cells)
        if (x + columns >= kGrid) columns = 0;
    const auto moved = [&](ModelPiece wood) {
      std::set<Cell> cells;
      for (const auto& [x, y] : wood.cells) cells.insert({x + columns, y});
      wood.carried_outline = Cell{wood.outline_cell().first + columns, wood.outline_cell().second};
      wood.panel = kept, wood.cells = std::move(cells);
      return wood;
    };
    std::vector<ModelPiece> gone, boxes;
    const auto take = [&](const std::vector<ModelPiece>& all, std::vector<ModelPiece>& into) {
      for (const ModelPiece& wood : all)
        if (wood.panel == merged && (wood.state == AllocationState::kCut || wood.state == AllocationState::kScrap))
          into.push_back(moved(wood));
    };
    for (const ModelJob& job : jobs_) take(job.pieces, gone);
    take(ruined_, gone);
    take(written_off_, boxes);
    const auto meets = [](const ModelPiece& a, const ModelPiece& b) {
      return std::any_of(a.cells.begin(), a.cells.end(), [&](const Cell& c) { return b.cells.contains(c); });
    };
    // Wood that is scrap on one of them and gone on both is booked once, but for 3 um around it, which no cell tells.
    bool contradicts = false, booked_twice = false;
    const auto hold = [&](const ModelPiece& held) {
      if (held.panel != kept) return;
      for (const auto* all : {&gone, &boxes})
        for (const ModelPiece& wood : *all) {
          if (!meets(wood, held)) continue;
          const bool may = held.state == AllocationState::kScrap ||
                           (held.state == AllocationState::kCut && wood.state == AllocationState::kScrap);
          (may ? booked_twice : contradicts) = true;
        }
    };
    for (const ModelPiece& wood : wood_of(kept)) hold(wood);
    for (const ModelPlan& plan : plans_)
      for (ModelPiece piece : plan.pieces)
        if (plan.lease && *plan.lease > kLater) piece.state = AllocationState::kReserved, hold(piece);
    const bool runs = run_ && (run_->panel == kept || run_->panel == merged);
    const ModelPanel& from = known_[merged];
    const bool may = kept != merged && !known_[kept].retired && !from.merged && !from.has_part && !runs &&
                     (from.retired || !is_held(merged, kLater));
    if (may && !contradicts && booked_twice) return;
    const Isometry2<PanelFrame, PanelFrame> kept_from_merged(Radians(0), point<PanelFrame>(columns * kCell, 0));
    const Status done = cell_.panels().merge(
        {panels_[kept], panels_[merged], kept_from_merged, 4, 0.01_mm, "local:1000", kLater}, {}, {});
    RC_ASSERT(done.ok() == (may && !contradicts));
    if (!done.ok()) return;
    known_[merged].retired = known_[merged].merged = true;
    known_[kept].scans_when_merged = std::max(known_[kept].scans_when_merged, scans_);
    ruined_.insert(ruined_.end(), gone.begin(), gone.end());
    written_off_.insert(written_off_.end(), boxes.begin(), boxes.end());
    expire(kLater);
  }
};

}  // namespace veneer::db
