// A model of the database: random jobs of random cell shapes, and random things done to both. It knows areas as sets of
// unit cells and shares no code with the ledger. Its parts, each of one concept, stand on one another: modelled_wood.h,
// _plans.h, _work.h, _panels.h, _scans.h, _facts.h.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "db/backup.h"
#include "tests/db/modelled_facts.h"

namespace veneer::db {

class ModelledCell : public ModelledFacts {
 public:
  // Numbers of what was done after a backup are given out again once it is put back: not for who remembers them.
  enum class Backups { kNone, kPutBack };
  explicit ModelledCell(Backups backups = Backups::kNone) : backups_(backups) {}

  void step() {
    switch (*rc::gen::inRange(0, backups_ == Backups::kPutBack ? 60 : 57)) {
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
      case 39:
      case 40:
        return propose();
      case 41:
      case 42:
        return decide_proposal();
      case 43:
        return edit_mask();
      case 44:
      case 45:
        return merge();
      case 46:
        return forget_cuts();
      case 47:
        return archive();
      case 48:
        return *rc::gen::inRange(0, 4) == 0 ? archive_what_is_done() : archive();
      case 49:
        return write_off_free();
      case 50:
        return look_at_a_face();
      case 51:
        return describe_panel();
      case 52:
        return describe_wood();
      case 53:
        return say_what_a_zone_is_of();
      case 54:
        return change_recipe();
      case 55:
        return book_remnant();
      case 56:
        return *rc::gen::inRange(0, 6) == 0 ? note_restoration() : scan_again();
      case 57:
      case 58:
        return back_up();
      case 59:
        return put_back();
      default:
        return die_and_recover();
    }
  }

  void compare() {
    for (ModelJob& job : jobs_) {
      const auto found = must(cell_.jobs().pieces(job.id));
      const JobRecord record = must(cell_.jobs().find(job.id));
      RC_ASSERT(record.state == job.state);
      // In sight as soon as somebody has to look at a piece.
      job.archived = job.archived && !job.any(AllocationState::kSuspect);
      RC_ASSERT(record.archived == job.archived);
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
    std::vector<PieceId> kept;
    for (const KeptCut& cut : must(cell_.jobs().kept_cuts())) kept.push_back(cut.piece);
    RC_ASSERT(kept == kept_cuts_);
    for (const ProposalRecord& found : must(Proposals(cell_.database()).list(true))) {
      const auto& verdict = proposals_[static_cast<std::size_t>(found.id.value - 1)].verdict;
      RC_ASSERT((found.decision ? std::optional(found.decision->verdict) : std::nullopt) == verdict);
    }
    for (const ModelPlan& plan : plans_) {
      const PlanRecord found = must(Plans(cell_.database()).find(plan.id));
      RC_ASSERT(found.placed == static_cast<int>(plan.pieces.size()));
      RC_ASSERT(found.jobs.empty() == !plan.has_job);
      RC_ASSERT((found.lease ? std::optional(found.lease->until) : std::nullopt) == plan.lease);
      const bool free = must(Plans(cell_.database()).taken(plan.id)).empty();
      if (can_be_made(plan, kEver)) RC_ASSERT(free && found.outdated.empty());
    }
    compare_woods();
    RC_ASSERT(must(cell_.panels().list()).size() == panels_.size());
    for (int panel = 0; panel < static_cast<int>(panels_.size()); ++panel) {
      compare_wood(panel);
      const PanelRecord found = must(cell_.panels().find(panels_[panel]));
      RC_ASSERT(found.retired.has_value() == known_[panel].retired);
      RC_ASSERT((found.retired && found.retired->sawn) == known_[panel].sawn);
      RC_ASSERT(must(cell_.panels().parts_of(panels_[panel])).empty() == !known_[panel].has_part);
      RC_ASSERT(found.mask_version == known_[panel].mask());
      RC_ASSERT(found.mask_file == known_[panel].counts);
      RC_ASSERT(must(cell_.panels().merged_into(panels_[panel])).has_value() == known_[panel].merged);
      std::vector<bool> edits;
      for (const MaskEdit& edit : must(Masks(cell_.database()).list(panels_[panel], {}, -1)).edits)
        edits.push_back(!edit.removal);
      RC_ASSERT(edits == known_[panel].edits);
      compare_facts(panel);
      RC_ASSERT(must(differences_store().open(panels_[panel])) ==
                std::count_if(differences_.begin(), differences_.end(),
                              [&](const auto& d) { return d.panel == panel && d.open; }));
    }
  }
  bool sound() { return cell_.database().check_integrity().ok(); }

  CellDatabase& cell() { return cell_; }
  const std::vector<PanelId>& panels() const { return panels_; }
  // The file of the mask that counts.
  const std::string& mask_of(int panel) const { return known_[static_cast<std::size_t>(panel)].counts; }
  // All that is booked on a panel: pieces, what was written off, and what pieces were cut from before they were made
  // again. Of `box` only the middle of its cell.
  struct Wood {
    AllocationState state = AllocationState::kReserved;
    std::set<Cell> cells;
    bool box = false;
    bool outlined = true;  // the outline lies in it
  };
  std::vector<Wood> wood_on(int panel) const {
    std::vector<Wood> out;
    const auto add = [&](const ModelPiece& piece, bool box) {
      if (piece.panel == panel && piece.state != AllocationState::kReleased)
        out.push_back({piece.state, piece.cells, box, piece.cells.contains(piece.outline_cell())});
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
  std::filesystem::path folder() const { return cell_.file().parent_path(); }
  void back_up() {
    namespace fs = std::filesystem;
    fs::remove_all(folder() / "backup");
    fs::create_directory(folder() / "backup");
    Database reader = must(Database::open_for_reading(cell_.file()));
    VENEER_EXPECT_OK(copy_database(reader, folder() / "backup" / "veneerd.db", [](double) {}, {}));
    if (fs::exists(folder() / "plans"))
      fs::copy(folder() / "plans", folder() / "backup" / "plans", fs::copy_options::recursive);
    backup_ = static_cast<const ModelledKnowledge&>(*this);
  }
  void put_back() {
    namespace fs = std::filesystem;
    if (!backup_) return back_up();
    // As a power cut right after the decision leaves it: whoever opens the database finishes the rest.
    fs::copy_file(folder() / "backup" / "veneerd.db", cell_.file().string() + ".restored");
    cell_.reopen();
    const auto over = fs::copy_options::recursive | fs::copy_options::overwrite_existing;
    if (fs::exists(folder() / "backup" / "plans")) fs::copy(folder() / "backup" / "plans", folder() / "plans", over);
    static_cast<ModelledKnowledge&>(*this) = *backup_;
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

  const Backups backups_;
  std::optional<ModelledKnowledge> backup_;
};

}  // namespace veneer::db
