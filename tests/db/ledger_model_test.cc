// The database against a model of it: random jobs of random cell shapes, and random things done to them. The model
// knows areas as sets of unit cells and shares no code with the ledger.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <SQLiteCpp/SQLiteCpp.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <utility>

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

constexpr int kGrid = 8;         // cells per side of a panel
constexpr double kCell = 12.5;   // mm
constexpr double kInset = 1.25;  // mm from an area's edge to its piece's outline
using Cell = std::pair<int, int>;

struct ModelPiece {
  PieceId id;
  int panel = 0;
  std::set<Cell> cells;
  AllocationState state = AllocationState::kReserved;
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
  std::array<int, 2> masks{};  // of the panels, when it was made
  bool has_job = false;
};
struct ModelRun {
  RunId id;
  std::size_t job = 0;
  int panel = 0;
};

Region<PanelFrame> area_of(const std::set<Cell>& cells) {
  std::vector<Region<PanelFrame>> squares;
  squares.reserve(cells.size());
  for (const auto& [x, y] : cells) squares.emplace_back(square(x * kCell, y * kCell, kCell));
  return unite(squares);
}

// A connected blob of cells, grown from a random one.
std::set<Cell> random_cells() {
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
    switch (*rc::gen::inRange(0, 17)) {
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
    }
    RC_ASSERT(must(cell_.jobs().list()).size() == jobs_.size());
    for (const ModelPlan& plan : plans_) {
      const PlanRecord found = must(Plans(cell_.database()).find(plan.id));
      RC_ASSERT(found.placed == static_cast<int>(plan.pieces.size()));
      RC_ASSERT(found.jobs.empty() == !plan.has_job);
      const bool free = must(Plans(cell_.database()).taken(plan.id)).empty();
      if (can_be_made(plan)) RC_ASSERT(free && found.outdated.empty());
    }
    for (const int panel : {0, 1}) compare_wood(panel);
  }
  bool sound() { return cell_.database().check_integrity().ok(); }

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
    for (const ModelPiece& gone : ruined_)
      if (gone.panel == panel) cells += gone.cells.size();
    RC_ASSERT(sum == static_cast<double>(cells) * kCell * kCell);
    RC_ASSERT(unite(areas).area().count() == sum);
  }

  template <class T>
  static std::vector<T*> pointers(std::vector<T>& all) {
    std::vector<T*> out;
    for (T& one : all) out.push_back(&one);
    return out;
  }

  bool taken(int panel, const std::set<Cell>& cells, const ModelJob& asking) const {
    const auto clash = [&](const ModelJob& job) {
      return std::any_of(job.pieces.begin(), job.pieces.end(), [&](const ModelPiece& other) {
        return other.panel == panel && other.state != AllocationState::kReleased &&
               std::any_of(cells.begin(), cells.end(), [&](const Cell& c) { return other.cells.count(c) > 0; });
      });
    };
    ModelJob gone;
    gone.pieces = ruined_;
    return clash(asking) || clash(gone) || std::any_of(jobs_.begin(), jobs_.end(), clash);
  }

  // What a plan wants; its pieces' wood may be taken, even by each other.
  ModelPlan compose() {
    ModelPlan plan;
    for (int i = 0, n = *rc::gen::inRange(1, 5); i < n; ++i) {
      ModelPiece& piece = plan.pieces.emplace_back();
      piece.panel = *rc::gen::inRange(0, 2);
      piece.cells = random_cells();
    }
    plan.masks = masks_;
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
    for (PlannedPanel& panel : out.planned_on) panel.mask_version = plan.masks[panel.panel == panels_[0] ? 0 : 1];
    return out;
  }
  bool can_be_made(const ModelPlan& plan) const {
    ModelJob job;
    for (const ModelPiece& piece : plan.pieces) {
      if (plan.masks[piece.panel] != masks_[piece.panel] || taken(piece.panel, piece.cells, job)) return false;
      job.pieces.push_back(piece);
    }
    return true;
  }
  void made(ModelPlan& plan, const Result<JobId>& created) {
    RC_ASSERT(created.ok() == can_be_made(plan));
    if (!created.ok()) return RC_ASSERT(created.error().code == ErrorCode::kConflict);
    ModelJob job;
    job.id = *created;
    job.pieces = plan.pieces;
    const auto records = must(cell_.jobs().pieces(job.id));
    for (std::size_t i = 0; i < records.size(); ++i) job.pieces[i].id = records[i].id;
    jobs_.push_back(job);
    plan.has_job = true;
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
    RC_ASSERT(Plans(cell_.database()).remove(plans_[index].id).ok() == !plans_[index].has_job);
    if (!plans_[index].has_job) plans_.erase(plans_.begin() + static_cast<std::ptrdiff_t>(index));
  }
  // Pieces that are lost, or cut and lost since, get other wood.
  void redo() {
    if (jobs_.empty()) return;
    ModelJob& job = jobs_[*rc::gen::inRange<std::size_t>(0, jobs_.size())];
    const std::size_t index = *rc::gen::inRange<std::size_t>(0, job.pieces.size());
    ModelPiece& piece = job.pieces[index];
    ModelPlan plan;
    plan.pieces.push_back(piece);
    plan.pieces.front().panel = *rc::gen::inRange(0, 2);
    plan.pieces.front().cells = random_cells();
    plan.masks = masks_;
    NewPlan again = to_store(plan);
    again.pieces.front().mark = fmt::format("A{}", index);
    const bool lost = piece.state == AllocationState::kCut || piece.state == AllocationState::kScrap ||
                      piece.state == AllocationState::kReleased;
    ModelJob nobody;
    const bool allowed =
        job.state != JobState::kRunning && lost && !taken(plan.pieces.front().panel, plan.pieces.front().cells, nobody);
    const auto redone = cell_.jobs().redo(job.id, again, kLater);
    RC_ASSERT(redone.ok() == allowed);
    if (!allowed) return RC_ASSERT(redone.error().code == ErrorCode::kConflict);
    if (piece.state != AllocationState::kReleased)
      ruined_.push_back(piece), ruined_.back().state = AllocationState::kScrap;
    piece.panel = plan.pieces.front().panel;
    piece.cells = plan.pieces.front().cells;
    piece.state = AllocationState::kReserved;
    if (job.state == JobState::kComplete || job.state == JobState::kCancelled) job.state = JobState::kStopped;
  }
  void scan_again() {
    const int panel = *rc::gen::inRange(0, 2);
    RC_ASSERT(must(cell_.panels().add_mask(panels_[panel], {0, "map", "mask", "hash", kNow}, masks_[panel])) ==
              masks_[panel] + 1);
    ++masks_[panel];
  }
  // Statements that nobody should make: nothing may come of them.
  void stray() {
    const char* statement = *rc::gen::elementOf(std::vector<const char*>{
        "DELETE FROM allocations", "DELETE FROM allocation_boxes", "UPDATE allocations SET state = 'released'",
        "DELETE FROM jobs", "INSERT OR REPLACE INTO audit (id, at, who, what, detail) VALUES (1, '', '', '', '')",
        "UPDATE runs SET ended_at = NULL", "DELETE FROM masks", "DROP TRIGGER allocations_are_kept"});
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
    const int panel = *rc::gen::inRange(0, 2);
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
  bool in_run(const ModelPiece& piece) const {
    if (!run_ || piece.panel != run_->panel) return false;
    const auto& pieces = jobs_[run_->job].pieces;
    return &piece >= pieces.data() && &piece < pieces.data() + pieces.size();
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
      RC_ASSERT(cell_.jobs().abort_run(run_->id, {}, "stop", kLater).ok());
      suspect_what_was_cutting(job);
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
      if (job.state == JobState::kStopped || job.state == JobState::kAborted) job.state = job.after(job.state);
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
      if (piece.state == AllocationState::kCutting) piece.state = AllocationState::kSuspect;
  }

  CellDatabase cell_;
  std::vector<PanelId> panels_;
  std::array<int, 2> masks_ = {1, 1};
  std::vector<ModelPlan> plans_;
  std::vector<ModelJob> jobs_;
  std::vector<ModelPiece> ruined_;  // what pieces were cut from before they were made again
  std::optional<ModelRun> run_;
};

RC_GTEST_PROP(LedgerModel, TheDatabaseAgreesWithTheModelWhateverIsDone, ()) {
  ModelledCell cell;
  const int steps = *rc::gen::inRange(20, 100);
  for (int i = 0; i < steps; ++i) {
    cell.step();
    cell.compare();
  }
  RC_ASSERT(cell.sound());
}

}  // namespace
}  // namespace veneer::db
