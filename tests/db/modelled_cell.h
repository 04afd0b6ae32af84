// A model of the database: random jobs of random cell shapes, and random things done to both. It knows areas as sets of
// unit cells and shares no code with the ledger.
#pragma once

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <SQLiteCpp/SQLiteCpp.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "db/differences.h"
#include "db/leases.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

inline constexpr int kGrid = 8;        // cells per side of a panel
inline constexpr double kCell = 12.5;  // mm
inline constexpr std::size_t kMostPanels = 5;
inline constexpr double kInset = 1.25;  // mm from an area's edge to its piece's outline
using Cell = std::pair<int, int>;

inline const std::string kBetween = "2026-05-01T08:00:00.000Z", kMuchLater = "2026-06-01T00:00:00.000Z";
// As a time: every lease that nobody has ended counts, and none does.
inline const std::string kEver, kNever = "~";

struct ModelPiece {
  PieceId id;
  int panel = 0;
  std::set<Cell> cells;
  AllocationState state = AllocationState::kReserved;
  bool seen = false;  // by a scan, since it became suspect

  void doubt() { state = AllocationState::kSuspect, seen = false; }
};
struct ModelPanel {
  int mask = 1;
  bool retired = false, sawn = false, has_part = false;
};
struct ModelJob {
  JobId id;
  JobState state = JobState::kPlanned;
  std::vector<ModelPiece> pieces;

  bool any(AllocationState wanted) const {
    return std::any_of(pieces.begin(), pieces.end(), [&](const auto& p) { return p.state == wanted; });
  }
  bool any_open() const {
    return any(AllocationState::kReserved) || any(AllocationState::kCutting) || any(AllocationState::kSuspect);
  }
  JobState after(JobState otherwise) const { return any_open() ? otherwise : JobState::kComplete; }
};
struct ModelPlan {
  PlanId id;
  std::vector<ModelPiece> pieces;
  std::vector<int> masks;  // of the panels, when it was made
  bool has_job = false;
  std::optional<std::string> lease;  // until when; until somebody ends it

  bool leases(int panel, const std::set<Cell>& cells, const std::string& at) const {
    return lease && *lease > at && std::any_of(pieces.begin(), pieces.end(), [&](const ModelPiece& piece) {
             return piece.panel == panel &&
                    std::any_of(cells.begin(), cells.end(), [&](const Cell& c) { return piece.cells.contains(c); });
           });
  }
};
struct ModelDifference {
  DifferenceId id;
  int panel = 0;
  Cell cell;
  bool gone = false, open = true, accepted = false;
};
struct ModelRun {
  RunId id;
  std::size_t job = 0;
  int panel = 0;
};

inline Region<PanelFrame> area_of(const std::set<Cell>& cells) {
  std::vector<Region<PanelFrame>> squares;
  squares.reserve(cells.size());
  for (const auto& [x, y] : cells) squares.emplace_back(square(x * kCell, y * kCell, kCell));
  return unite(squares);
}

// A connected blob of cells, grown from a random one.
inline std::set<Cell> random_cells() {
  std::set<Cell> cells = {{*rc::gen::inRange(0, kGrid), *rc::gen::inRange(0, kGrid)}};
  const int size = *rc::gen::inRange(1, 6);
  for (int i = 1; i < size; ++i) {
    auto [x, y] = *rc::gen::elementOf(cells);
    (*rc::gen::arbitrary<bool>() ? x : y) += *rc::gen::arbitrary<bool>() ? 1 : -1;
    if (x >= 0 && y >= 0 && x < kGrid && y < kGrid) cells.insert({x, y});
  }
  return cells;
}

class ModelledCell {
 public:
  ModelledCell() : panels_{cell_.new_panel(), cell_.new_panel()} {}

  void step() {
    switch (*rc::gen::inRange(0, 39)) {
      case 0:
        return create();
      case 1:
      case 10:
        return create_from_plan();
      case 11:
        return store_plan();
      case 12:
        return remove_plan();
      case 13:
        return *rc::gen::inRange(0, 4) == 0 ? scan_again() : stray();
      case 2:
        return cancel();
      case 3:
        return start_run();
      case 4:
      case 5:
        return mark_cutting();
      case 6:
        return book();
      case 7:
        return finish_or_abort();
      case 8:
        return settle();
      case 15:
      case 16:
        return redo();
      case 17:
        return write_off();
      case 18:
        return retire_or_restore();
      case 19:
        return find_differences();
      case 20:
      case 21:
        return decide_difference();
      case 22:
        return take_back_a_scan();
      case 23:
        return stray_beam();
      case 24:
        return end_between_panels();
      case 26:
      case 27:
      case 28:
        return lease();
      case 29:
        return release();
      case 30:
        return let_time_pass();
      case 31:
        return create_from_plan();
      case 9:  // small numbers come more often
      case 33:
      case 34:
        return saw_apart();
      case 14:
      case 35:
      case 36:
      case 37:
        return enter_part();
      case 38:
        return look_at_a_piece();
      default:
        return die_and_recover();
    }
  }

  void compare() {
    for (const ModelJob& job : jobs_) {
      const auto found = must(cell_.jobs().pieces(job.id));
      RC_ASSERT(must(cell_.jobs().find(job.id)).state == job.state);
      RC_ASSERT(found.size() == job.pieces.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        RC_ASSERT(std::string(to_string(found[i].state)) == to_string(job.pieces[i].state));
      for (std::size_t i = 0; i < found.size(); ++i)
        RC_ASSERT(found[i].sighting.has_value() ==
                  (job.pieces[i].state == AllocationState::kSuspect && job.pieces[i].seen));
      // What is told of a piece ends with what it is.
      for (const PieceRecord& piece : found) {
        const auto steps = must(cell_.jobs().history(piece.id));
        RC_ASSERT(steps.empty() == (piece.state == PieceState::kUnfilled));
        if (steps.empty()) continue;
        RC_ASSERT(std::string(to_string(steps.back().state)) == to_string(piece.state));
        RC_ASSERT(steps.back().allocation == piece.allocation);
      }
    }
    RC_ASSERT(must(cell_.jobs().list()).size() == jobs_.size());
    for (const ModelPlan& plan : plans_) {
      const PlanRecord found = must(Plans(cell_.database()).find(plan.id));
      RC_ASSERT(found.placed == static_cast<int>(plan.pieces.size()));
      RC_ASSERT(found.jobs.empty() == !plan.has_job);
      RC_ASSERT((found.lease ? std::optional(found.lease->until) : std::nullopt) == plan.lease);
      const bool free = must(Plans(cell_.database()).taken(plan.id)).empty();
      if (can_be_made(plan, kEver)) RC_ASSERT(free && found.outdated.empty());
    }
    RC_ASSERT(must(cell_.panels().list()).size() == panels_.size());
    for (int panel = 0; panel < static_cast<int>(panels_.size()); ++panel) {
      compare_wood(panel);
      const PanelRecord found = must(cell_.panels().find(panels_[panel]));
      RC_ASSERT(found.retired.has_value() == known_[panel].retired);
      RC_ASSERT((found.retired && found.retired->sawn) == known_[panel].sawn);
      RC_ASSERT(must(cell_.panels().parts_of(panels_[panel])).empty() == !known_[panel].has_part);
      RC_ASSERT(found.mask_version == known_[panel].mask);
      RC_ASSERT(must(differences_store().open(panels_[panel])) ==
                std::count_if(differences_.begin(), differences_.end(),
                              [&](const auto& d) { return d.panel == panel && d.open; }));
    }
  }
  bool sound() { return cell_.database().check_integrity().ok(); }

  CellDatabase& cell() { return cell_; }
  const std::vector<PanelId>& panels() const { return panels_; }
  // All that is booked on a panel: pieces, what was written off, and what pieces were cut from before they were made
  // again. Of `box` only the middle of its cell.
  struct Wood {
    AllocationState state = AllocationState::kReserved;
    std::set<Cell> cells;
    bool box = false;
  };
  std::vector<Wood> wood_on(int panel) const {
    std::vector<Wood> out;
    const auto add = [&](const ModelPiece& piece, bool box) {
      if (piece.panel == panel && piece.state != AllocationState::kReleased)
        out.push_back({piece.state, piece.cells, box});
    };
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces) add(piece, false);
    for (const ModelPlan& plan : plans_)
      if (plan.lease)
        for (const ModelPiece& piece : plan.pieces)
          if (piece.panel == panel) out.push_back({AllocationState::kLeased, piece.cells, false});
    for (const ModelPiece& gone : ruined_) add(gone, false);
    for (const ModelPiece& box : written_off_) add(box, true);
    return out;
  }

 private:
  void compare_wood(int panel) {
    std::vector<Region<PanelFrame>> areas;
    double sum = 0;
    for (const auto& live : must(cell_.ledger().live_allocations(panels_[panel]))) {
      areas.push_back(live.area);
      sum += live.area.area().count();
    }
    std::size_t cells = 0;
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces)
        if (piece.panel == panel && piece.state != AllocationState::kReleased) cells += piece.cells.size();
    for (const ModelPlan& plan : plans_)
      for (const ModelPiece& piece : plan.pieces)
        if (plan.lease && piece.panel == panel) cells += piece.cells.size();
    for (const ModelPiece& gone : ruined_)
      if (gone.panel == panel) cells += gone.cells.size();
    constexpr double kWrittenOff = (kCell - 2 * kInset) * (kCell - 2 * kInset);
    const auto boxes = std::count_if(written_off_.begin(), written_off_.end(),
                                     [&](const ModelPiece& box) { return box.panel == panel; });
    RC_ASSERT(sum == static_cast<double>(cells) * kCell * kCell + static_cast<double>(boxes) * kWrittenOff);
    RC_ASSERT(unite(areas).area().count() == sum);
  }

  template <class T>
  static std::vector<T*> pointers(std::vector<T>& all) {
    std::vector<T*> out;
    for (T& one : all) out.push_back(&one);
    return out;
  }

  // By another piece, or under the lease of another plan than `own` that is not over `at` this time.
  bool taken(int panel, const std::set<Cell>& cells, const ModelJob& asking, const std::string& at,
             const ModelPlan* own = nullptr) const {
    for (const ModelPlan& plan : plans_)
      if (&plan != own && plan.leases(panel, cells, at)) return true;
    const auto clash = [&](const ModelJob& job) {
      return std::any_of(job.pieces.begin(), job.pieces.end(), [&](const ModelPiece& other) {
        return other.panel == panel && other.state != AllocationState::kReleased &&
               std::any_of(cells.begin(), cells.end(), [&](const Cell& c) { return other.cells.count(c) > 0; });
      });
    };
    ModelJob gone, boxes;
    gone.pieces = ruined_;
    boxes.pieces = written_off_;
    return clash(asking) || clash(gone) || clash(boxes) || std::any_of(jobs_.begin(), jobs_.end(), clash);
  }

  int any_panel() const { return *rc::gen::inRange(0, static_cast<int>(panels_.size())); }
  std::size_t index_of(const PanelId& panel) const {
    return static_cast<std::size_t>(std::find(panels_.begin(), panels_.end(), panel) - panels_.begin());
  }
  std::vector<int> masks() const {
    std::vector<int> out;
    for (const ModelPanel& panel : known_) out.push_back(panel.mask);
    return out;
  }

  // What a plan wants; its pieces' wood may be taken, even by each other.
  ModelPlan compose() {
    ModelPlan plan;
    for (int i = 0, n = *rc::gen::inRange(1, 5); i < n; ++i) {
      ModelPiece& piece = plan.pieces.emplace_back();
      piece.panel = any_panel();
      piece.cells = random_cells();
    }
    plan.masks = masks();
    return plan;
  }
  NewPlan to_store(const ModelPlan& plan) const {
    std::vector<PlannedPatch> patches;
    for (const ModelPiece& piece : plan.pieces) {
      const auto& [x, y] = *piece.cells.begin();
      patches.push_back(square_piece(fmt::format("A{}", patches.size()), panels_[piece.panel], x * kCell + kInset,
                                     y * kCell + kInset, kCell - 2 * kInset));
      patches.back().allocation = area_of(piece.cells);
    }
    NewPlan out = job_of(patches);
    for (PlannedPanel& panel : out.planned_on) panel.mask_version = plan.masks[index_of(panel.panel)];
    return out;
  }
  bool can_be_made(const ModelPlan& plan, const std::string& at) const {
    ModelJob job;
    for (const ModelPiece& piece : plan.pieces) {
      if (plan.masks[piece.panel] != known_[piece.panel].mask || known_[piece.panel].retired ||
          taken(piece.panel, piece.cells, job, at, &plan))
        return false;
      job.pieces.push_back(piece);
    }
    return true;
  }
  void made(ModelPlan& plan, const Result<JobId>& created) {
    RC_ASSERT(created.ok() == can_be_made(plan, kNow));
    if (!created.ok()) return RC_ASSERT(created.error().code == ErrorCode::kConflict);
    ModelJob job;
    job.id = *created;
    job.pieces = plan.pieces;
    const auto records = must(cell_.jobs().pieces(job.id));
    for (std::size_t i = 0; i < records.size(); ++i) job.pieces[i].id = records[i].id;
    jobs_.push_back(job);
    plan.has_job = true;
    plan.lease.reset();
    expire(kNow);
  }
  // Leases whose time has come end with whatever is done next.
  std::size_t expire(const std::string& at) {
    std::size_t count = 0;
    for (ModelPlan& plan : plans_)
      if (plan.lease && *plan.lease <= at) plan.lease.reset(), ++count;
    return count;
  }
  void lease() {
    if (plans_.empty()) return store_plan();
    ModelPlan& plan = **rc::gen::elementOf(pointers(plans_));
    const std::string at = *rc::gen::element(kNow, kLater), until = *rc::gen::element(kBetween, kMuchLater);
    const bool renewed = plan.lease && *plan.lease > at;
    const bool allowed = until > at && (renewed || can_be_made(plan, at));
    const auto leased = Leases(cell_.database()).take(plan.id, "local:1000", at, until);
    RC_ASSERT(leased.ok() == allowed);
    if (!allowed)
      return RC_ASSERT(leased.error().code == (until > at ? ErrorCode::kConflict : ErrorCode::kInvalidArgument));
    expire(at);
    plan.lease = until;
  }
  void release() {
    if (plans_.empty()) return;
    ModelPlan& plan = **rc::gen::elementOf(pointers(plans_));
    RC_ASSERT(Leases(cell_.database()).release(plan.id, kLater).ok() == plan.lease.has_value());
    plan.lease.reset();
  }
  void let_time_pass() {
    const std::string at = *rc::gen::element(kNow, kBetween, kLater, kMuchLater);
    RC_ASSERT(must(Leases(cell_.database()).expire(at)).size() == expire(at));
  }

  void create() {
    ModelPlan plan = compose();
    made(plan, cell_.jobs().create(to_store(plan), kNow));
  }
  void store_plan() {
    ModelPlan plan = compose();
    plan.id = must(Plans(cell_.database()).add(to_store(plan), kNow));
    plans_.push_back(plan);
  }
  void create_from_plan() {
    if (plans_.empty()) return store_plan();
    ModelPlan& plan = **rc::gen::elementOf(pointers(plans_));
    made(plan, cell_.jobs().create(plan.id, kNow));
  }
  void remove_plan() {
    if (plans_.empty()) return;
    const std::size_t index = *rc::gen::inRange<std::size_t>(0, plans_.size());
    const bool allowed = !plans_[index].has_job && !plans_[index].lease;
    RC_ASSERT(Plans(cell_.database()).remove(plans_[index].id).ok() == allowed);
    if (allowed) plans_.erase(plans_.begin() + static_cast<std::ptrdiff_t>(index));
  }
  // Pieces that are lost, or cut and lost since, get other wood.
  void redo() {
    if (jobs_.empty()) return;
    ModelJob& job = jobs_[*rc::gen::inRange<std::size_t>(0, jobs_.size())];
    const std::size_t index = *rc::gen::inRange<std::size_t>(0, job.pieces.size());
    ModelPiece& piece = job.pieces[index];
    ModelPlan plan;
    plan.pieces.push_back(piece);
    plan.pieces.front().panel = any_panel();
    plan.pieces.front().cells = random_cells();
    plan.masks = masks();
    NewPlan again = to_store(plan);
    again.pieces.front().mark = fmt::format("A{}", index);
    const bool lost = piece.state == AllocationState::kCut || piece.state == AllocationState::kScrap ||
                      piece.state == AllocationState::kReleased;
    ModelJob nobody;
    const ModelPiece& wanted = plan.pieces.front();
    const bool allowed = job.state != JobState::kRunning && lost && !known_[wanted.panel].retired &&
                         !taken(wanted.panel, wanted.cells, nobody, kLater);
    const auto redone = cell_.jobs().redo(job.id, again, kLater);
    RC_ASSERT(redone.ok() == allowed);
    if (!allowed) return RC_ASSERT(redone.error().code == ErrorCode::kConflict);
    expire(kLater);
    if (piece.state != AllocationState::kReleased)
      ruined_.push_back(piece), ruined_.back().state = AllocationState::kScrap;
    piece.panel = plan.pieces.front().panel;
    piece.cells = plan.pieces.front().cells;
    piece.state = AllocationState::kReserved;
    if (job.state == JobState::kComplete || job.state == JobState::kCancelled) job.state = JobState::kStopped;
  }
  void scan_again() {
    const int panel = any_panel();
    const auto added = cell_.panels().add_mask(panels_[panel], {0, "map", "mask", "hash", kNow}, known_[panel].mask);
    RC_ASSERT(added.ok() == !known_[panel].retired);
    if (added.ok()) RC_ASSERT(*added == ++known_[panel].mask);
  }
  void take_back_a_scan() {
    const int panel = any_panel(), version = *rc::gen::inRange(1, known_[panel].mask + 2);
    const auto back = cell_.panels().revert_mask(panels_[panel], version, kLater);
    RC_ASSERT(back.ok() == (version < known_[panel].mask));
    if (back.ok()) RC_ASSERT(*back == ++known_[panel].mask);
  }

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
  // Is any of its wood to be cut, in doubt, or leased beyond this time?
  bool is_held(int panel, const std::string& at) const {
    bool held = false;
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces)
        held = held || (piece.panel == panel &&
                        (piece.state == AllocationState::kReserved || piece.state == AllocationState::kCutting ||
                         piece.state == AllocationState::kSuspect));
    for (const ModelPlan& plan : plans_)
      for (const ModelPiece& piece : plan.pieces)
        held = held || (piece.panel == panel && plan.leases(panel, piece.cells, at));
    return held;
  }
  void retire_or_restore() {
    const int panel = any_panel();
    ModelPanel& known = known_[panel];
    if (*rc::gen::inRange(0, 3) != 0) {
      const bool allowed = known.retired && !known.has_part;
      RC_ASSERT(cell_.panels().restore(panels_[panel], "glued", kLater).ok() == allowed);
      if (allowed) known.retired = known.sawn = false;
      return;
    }
    const bool allowed = !known.retired && !is_held(panel, kLater);
    RC_ASSERT(cell_.panels().retire(panels_[panel], "split", kLater).ok() == allowed);
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
    const bool any = whole.empty() || *rc::gen::inRange(0, 4) == 0;
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
    const int columns = *rc::gen::inRange(0, kGrid);
    PanelRecord part = sheet(must(cell_.panels().next_panel_id()));
    part.parent = panels_[parent];
    std::vector<ModelPiece> gone = ruined_, boxes = written_off_;
    bool doubtful = false;
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces) {
        if (piece.state == AllocationState::kCut || piece.state == AllocationState::kScrap) gone.push_back(piece);
        doubtful = doubtful || (piece.panel == parent && piece.state == AllocationState::kSuspect);
      }
    const bool allowed = known_[parent].sawn && !doubtful;
    const Isometry2<PanelFrame, PanelFrame> part_from_parent(Radians(0), point<PanelFrame>(-columns * kCell, 0));
    const Status entered = cell_.panels().add_part(part, {}, {}, {part_from_parent, 3, 0.02_mm});
    RC_ASSERT(entered.ok() == allowed);
    if (!allowed) return RC_ASSERT(entered.error().code == ErrorCode::kConflict);
    const int here = static_cast<int>(panels_.size());
    panels_.push_back(part.id);
    known_.emplace_back();
    known_[parent].has_part = true;
    for (auto* wood : {&gone, &boxes})
      for (const ModelPiece& was : *wood) {
        if (was.panel != parent) continue;
        ModelPiece carried;
        carried.panel = here, carried.state = was.state;
        for (const auto& [x, y] : was.cells)
          if (x >= columns) carried.cells.insert({x - columns, y});
        if (!carried.cells.empty()) (wood == &gone ? ruined_ : written_off_).push_back(carried);
      }
  }
  // A scan of its panel saw of its wood what it saw.
  void look_at_a_piece() {
    ModelPiece* piece = random_piece();
    if (piece == nullptr) return;
    const auto record = must(cell_.jobs().find_piece(piece->id));
    const std::pair seen(record.allocation, Sighting{Seen::kCut, 0.97, 1, kLater});
    VENEER_EXPECT_OK(cell_.jobs().note_sightings({&seen, 1}));
    piece->seen = piece->state == AllocationState::kSuspect;
  }

  Differences differences_store() { return Differences(cell_.database()); }
  // What a scan shows: each is in the middle of a cell, so that those of two cells never meet.
  void find_differences() {
    const int panel = any_panel();
    std::set<std::pair<Cell, bool>> seen;
    for (int i = 0, n = *rc::gen::inRange(0, 4); i < n; ++i)
      seen.insert({{*rc::gen::inRange(0, kGrid), *rc::gen::inRange(0, kGrid)}, *rc::gen::inRange(0, 3) != 0});
    std::vector<DifferenceRecord> found;
    for (const auto& [cell, gone] : seen) {
      DifferenceRecord& one = found.emplace_back();
      one.gone = gone;
      const auto ring = square(cell.first * kCell + kInset, cell.second * kCell + kInset, kCell - 2 * kInset);
      one.shape = Region<PanelFrame>(ring);
      one.place = ring.front();
      one.area = SquareMillimetres(9);
    }
    VENEER_EXPECT_OK(differences_store().found(panels_[panel], found, kNow));
    const auto all = seen;
    for (ModelDifference& known : differences_) {
      if (known.panel != panel || !(known.open || known.accepted)) continue;
      seen.erase({known.cell, known.gone});
      const bool there = all.contains({known.cell, known.gone});
      known.open = known.open && there, known.accepted = known.accepted && there;
    }
    for (const auto& [cell, gone] : seen)
      differences_.push_back({{static_cast<std::int64_t>(differences_.size()) + 1}, panel, cell, gone, true});
  }
  void decide_difference() {
    if (differences_.empty()) return find_differences();
    ModelDifference& known = **rc::gen::elementOf(pointers(differences_));
    const bool off = *rc::gen::inRange(0, 3) != 0;
    ModelPiece box;
    box.panel = known.panel;
    box.cells = {known.cell};
    box.state = AllocationState::kScrap;
    const bool adds = off && !taken(box.panel, box.cells, {}, kNever);
    const bool allowed = known.open && (!off || (known.gone && !run_)) && !(adds && known_[known.panel].retired);
    const auto done = differences_store().decide(panels_[known.panel], known.id,
                                                 off ? DifferenceVerdict::kWrittenOff : DifferenceVerdict::kAccepted,
                                                 "local:1000", "", kLater);
    RC_ASSERT(done.ok() == allowed);
    if (!allowed) return;
    known.open = false;
    known.accepted = !off;
    std::vector<ModelPiece*> over;  // they were to be cut from wood that is gone
    for (ModelJob& job : jobs_)
      for (ModelPiece& piece : job.pieces)
        if (off && piece.panel == known.panel && piece.cells.contains(known.cell) &&
            piece.state == AllocationState::kReserved)
          over.push_back(&piece);
    RC_ASSERT(done->size() == over.size());
    doubt(over);
    if (adds) written_off_.push_back(box);
    if (!off) return;
    expire(kLater);
    for (ModelPlan& plan : plans_)  // the picture cannot be made of what is left
      if (plan.leases(box.panel, box.cells, kEver)) plan.lease.reset();
  }

  // While a panel's frame is traced or a cut repeated.
  void stray_beam() {
    const auto hit = random_pieces();
    VENEER_EXPECT_OK(cell_.jobs().make_suspect(ids_of(hit), kLater));
    doubt(hit);
  }
  void end_between_panels() {
    if (jobs_.empty()) return;
    const std::size_t index = *rc::gen::inRange<std::size_t>(0, jobs_.size());
    ModelJob& job = jobs_[index];
    const bool waits = job.state == JobState::kRunning && !(run_ && run_->job == index);
    const bool stop = *rc::gen::arbitrary<bool>();
    const Status done = stop ? cell_.jobs().stop_job(job.id, kLater) : cell_.jobs().abort_job(job.id, kLater);
    RC_ASSERT(done.ok() == waits);
    if (waits) job.state = job.after(stop ? JobState::kStopped : JobState::kAborted);
  }
  // Statements that nobody should make: nothing may come of them.
  void stray() {
    const char* statement = *rc::gen::elementOf(std::vector<const char*>{
        "DELETE FROM allocations", "DELETE FROM allocation_boxes", "UPDATE allocations SET state = 'released'",
        "DELETE FROM jobs", "INSERT OR REPLACE INTO audit (id, at, who, what, detail) VALUES (1, '', '', '', '')",
        "UPDATE runs SET ended_at = NULL", "DELETE FROM masks", "UPDATE leases SET ended = 'expired', ended_at = 't'",
        "DROP TRIGGER allocations_are_kept"});
    bool refused = false;
    try {
      cell_.database().connection().exec(statement);
    } catch (const SQLite::Exception&) {
      refused = true;
    }
    RC_ASSERT(refused);
  }

  void cancel() {
    if (jobs_.empty()) return;
    ModelJob& job = jobs_[*rc::gen::inRange<std::size_t>(0, jobs_.size())];
    const bool allowed =
        job.state == JobState::kPlanned || job.state == JobState::kStopped || job.state == JobState::kAborted;
    RC_ASSERT(cell_.jobs().cancel(job.id, kLater).ok() == allowed);
    if (!allowed) return;
    job.state = JobState::kCancelled;
    for (auto& piece : job.pieces)
      if (piece.state == AllocationState::kReserved) piece.state = AllocationState::kReleased;
  }

  void start_run() {
    if (jobs_.empty()) return;
    const std::size_t index = *rc::gen::inRange<std::size_t>(0, jobs_.size());
    ModelJob& job = jobs_[index];
    const int panel = any_panel();
    const bool startable = job.state != JobState::kComplete && job.state != JobState::kCancelled;
    const bool wood = std::any_of(job.pieces.begin(), job.pieces.end(), [&](const auto& p) {
      return p.panel == panel && p.state == AllocationState::kReserved;
    });
    const auto run = cell_.jobs().start_run(job.id, panels_[panel], {}, 0.05_mm, kNow);
    RC_ASSERT(run.ok() == (!run_ && startable && wood));
    if (!run.ok()) return;
    run_ = ModelRun{*run, index, panel};
    job.state = JobState::kRunning;
  }

  ModelPiece* random_piece() {
    std::vector<ModelPiece*> all;
    for (auto& job : jobs_)
      for (auto& piece : job.pieces) all.push_back(&piece);
    return all.empty() ? nullptr : *rc::gen::elementOf(all);
  }
  std::vector<ModelPiece*> random_pieces() {
    std::vector<ModelPiece*> out;
    for (int i = 0, n = *rc::gen::inRange(0, 4); i < n; ++i)
      if (ModelPiece* piece = random_piece()) out.push_back(piece);
    return out;
  }
  static std::vector<PieceId> ids_of(const std::vector<ModelPiece*>& pieces) {
    std::vector<PieceId> out;
    for (const ModelPiece* piece : pieces) out.push_back(piece->id);
    return out;
  }
  static void doubt(const std::vector<ModelPiece*>& pieces) {
    for (ModelPiece* piece : pieces)
      if (piece->state == AllocationState::kReserved || piece->state == AllocationState::kCut) piece->doubt();
  }
  static bool has(const ModelJob& job, const ModelPiece& piece) {
    return &piece >= job.pieces.data() && &piece < job.pieces.data() + job.pieces.size();
  }
  bool in_run(const ModelPiece& piece) const {
    return run_ && piece.panel == run_->panel && has(jobs_[run_->job], piece);
  }

  void mark_cutting() {
    ModelPiece* piece = random_piece();
    if (piece == nullptr) return;
    const bool allowed = in_run(*piece) && piece->state == AllocationState::kReserved;
    RC_ASSERT(cell_.jobs().mark_cutting(piece->id, kNow).ok() == allowed);
    if (allowed) piece->state = AllocationState::kCutting;
  }

  void book() {
    ModelPiece* piece = random_piece();
    if (piece == nullptr) return;
    const bool allowed = piece->state == AllocationState::kCutting;
    RC_ASSERT(cell_.jobs().book_piece(piece->id, kNow).ok() == allowed);
    if (allowed) piece->state = AllocationState::kCut;
  }

  void finish_or_abort() {
    if (!run_) return;
    ModelJob& job = jobs_[run_->job];
    if (*rc::gen::arbitrary<bool>()) {
      const bool more = *rc::gen::arbitrary<bool>();
      const bool allowed = !job.any(AllocationState::kCutting);
      RC_ASSERT(cell_.jobs().finish_run(run_->id, more, kLater).ok() == allowed);
      if (!allowed) return;
      const bool goes_on = more && job.any(AllocationState::kReserved);
      job.state = job.after(goes_on ? JobState::kRunning : JobState::kStopped);
    } else {
      // The next pieces of this run, which the beam may have begun, and others that it may have hit.
      std::vector<ModelPiece*> suspects;
      for (ModelPiece& piece : job.pieces)
        if (in_run(piece) && *rc::gen::inRange(0, 4) == 0) suspects.push_back(&piece);
      const auto neighbours = *rc::gen::inRange(0, 3) == 0 ? random_pieces() : std::vector<ModelPiece*>();
      VENEER_EXPECT_OK(cell_.jobs().abort_run(run_->id, ids_of(suspects), "stop", kLater, ids_of(neighbours)));
      for (ModelPiece* piece : suspects)
        if (piece->state == AllocationState::kReserved) piece->doubt();
      suspect_what_was_cutting(job);
      doubt(neighbours);
      job.state = job.after(JobState::kAborted);
    }
    run_.reset();
  }

  void settle() {
    ModelPiece* piece = random_piece();
    if (piece == nullptr) return;
    const auto verdict =
        *rc::gen::elementOf(std::vector{AllocationState::kCut, AllocationState::kScrap, AllocationState::kReleased});
    const bool allowed = piece->state == AllocationState::kSuspect;
    RC_ASSERT(cell_.jobs().settle(piece->id, verdict, kLater).ok() == allowed);
    if (!allowed) return;
    piece->state = verdict;
    for (auto& job : jobs_)
      if (has(job, *piece) && (job.state == JobState::kStopped || job.state == JobState::kAborted))
        job.state = job.after(job.state);
  }

  void die_and_recover() {
    cell_.reopen();
    must(cell_.jobs().recover(kLater));
    run_.reset();
    for (auto& job : jobs_) {
      if (job.state != JobState::kRunning) continue;
      suspect_what_was_cutting(job);
      job.state = job.after(JobState::kAborted);
    }
  }

  static void suspect_what_was_cutting(ModelJob& job) {
    for (auto& piece : job.pieces)
      if (piece.state == AllocationState::kCutting) piece.doubt();
  }

  CellDatabase cell_;
  std::vector<PanelId> panels_;
  std::vector<ModelPanel> known_ = std::vector<ModelPanel>(2);  // of panels_
  std::vector<ModelPlan> plans_;
  std::vector<ModelJob> jobs_;
  std::vector<ModelPiece> ruined_;       // written off, or what pieces were cut from before they were made again
  std::vector<ModelPiece> written_off_;  // boxes of differences, in the middle of their cells
  std::vector<ModelDifference> differences_;
  std::optional<ModelRun> run_;
};

}  // namespace veneer::db
