// A model of the database: random jobs of random cell shapes, and random things done to both. It knows areas as sets of
// unit cells and shares no code with the ledger. Its parts, each of one concept, stand on one another: modelled_wood.h,
// _plans.h, _work.h, _panels.h, _scans.h, _facts.h, _people.h.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <array>

#include "db/backup.h"
#include "tests/db/modelled_people.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {

class ModelledCell : public ModelledPeople {
 public:
  // Numbers of what was done after a backup are given out again once it is put back: not for who remembers them.
  enum class Backups { kNone, kPutBack };
  explicit ModelledCell(Backups backups = Backups::kNone) : backups_(backups) {}

  struct Command {
    const char* name;
    int weight;  // how often it comes, beside the others
    void (ModelledCell::*give)();
  };
  // The last two are of backups.
  static const std::vector<Command>& commands() {
    static const std::vector<Command> all = {
        {"create", 4, &ModelledCell::create},
        {"create_from_plan", 7, &ModelledCell::create_from_plan},
        {"cancel", 1, &ModelledCell::cancel},
        {"start_run", 5, &ModelledCell::start_run},
        {"mark_cutting", 7, &ModelledCell::mark_cutting},
        {"book", 5, &ModelledCell::book},
        {"finish_or_abort", 4, &ModelledCell::finish_or_abort},
        {"settle", 3, &ModelledCell::settle},
        {"look_and_settle", 4, &ModelledCell::look_and_settle},
        {"break_off_or_clear", 1, &ModelledCell::break_off_or_clear},
        {"saw_apart", 3, &ModelledCell::saw_apart},
        {"store_plan", 4, &ModelledCell::store_plan},
        {"remove_plan", 1, &ModelledCell::remove_plan},
        {"scan_or_stray", 3, &ModelledCell::scan_or_stray},
        {"enter_part", 3, &ModelledCell::enter_part},
        {"redo", 5, &ModelledCell::redo},
        {"cut_some_and_redo", 3, &ModelledCell::cut_some_and_redo},
        {"write_off", 1, &ModelledCell::write_off},
        {"retire_or_restore", 4, &ModelledCell::retire_or_restore},
        {"find_differences", 1, &ModelledCell::find_differences},
        {"decide_difference", 3, &ModelledCell::decide_difference},
        {"take_back_a_scan", 1, &ModelledCell::take_back_a_scan},
        {"stray_beam", 1, &ModelledCell::stray_beam},
        {"end_between_panels", 5, &ModelledCell::end_between_panels},
        {"die_and_recover", 1, &ModelledCell::die_and_recover},
        {"lease", 6, &ModelledCell::lease},
        {"release", 3, &ModelledCell::release},
        {"let_time_pass", 3, &ModelledCell::let_time_pass},
        {"look_at_a_piece", 1, &ModelledCell::look_at_a_piece},
        {"propose", 2, &ModelledCell::propose},
        {"decide_proposal", 2, &ModelledCell::decide_proposal},
        {"edit_mask", 3, &ModelledCell::edit_mask},
        {"merge", 2, &ModelledCell::merge},
        {"forget_cuts", 1, &ModelledCell::forget_cuts},
        {"archive", 1, &ModelledCell::archive},
        {"archive_some", 2, &ModelledCell::archive_some},
        {"put_before", 2, &ModelledCell::put_before},
        {"write_off_free", 1, &ModelledCell::write_off_free},
        {"look_at_a_face", 1, &ModelledCell::look_at_a_face},
        {"describe_panel", 1, &ModelledCell::describe_panel},
        {"describe_wood", 1, &ModelledCell::describe_wood},
        {"say_what_a_zone_is_of", 2, &ModelledCell::say_what_a_zone_is_of},
        {"draw_a_zone", 1, &ModelledCell::draw_a_zone},
        {"change_recipe", 2, &ModelledCell::change_recipe},
        {"book_remnant", 1, &ModelledCell::book_remnant},
        {"restoration_or_scan", 2, &ModelledCell::restoration_or_scan},
        {"see_panel", 2, &ModelledCell::see_panel},
        {"assemble", 2, &ModelledCell::assemble},
        {"change_users", 3, &ModelledCell::change_users},
        {"change_credentials", 4, &ModelledCell::change_credentials},
        {"take_request", 4, &ModelledCell::take_request},
        {"certify", 1, &ModelledCell::certify},
        {"note", 1, &ModelledCell::note},
        {"doubt_and_check", 2, &ModelledCell::doubt_and_check},
        {"enter_mask", 1, &ModelledCell::enter_mask},
        {"enter_zones", 1, &ModelledCell::enter_zones},
        {"back_up", 1, &ModelledCell::back_up},
        {"put_back", 1, &ModelledCell::put_back},
    };
    return all;
  }
  void step() {
    const auto end = commands().end() - (backups_ == Backups::kPutBack ? 0 : 2);
    int all = 0;
    for (auto one = commands().begin(); one != end; ++one) all += one->weight;
    int drawn = *in_range(0, all);
    auto command = commands().begin();
    for (; drawn >= command->weight; ++command) drawn -= command->weight;
    give(*command);
  }
  void give(const std::string& name) { give(*std::ranges::find(commands(), name, &Command::name)); }
  // How often each command was given; nothing of one that never was.
  const std::map<std::string, int>& given() const { return given_; }
  int made_again_at_once() const { return made_again_at_once_; }
  // How often a backup was put back.
  int restored() const { return restored_; }

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
                  (job.pieces[i].state == AllocationState::kSuspect && counts(job.pieces[i])));
      // What is told of a piece ends with what it is.
      for (const PieceRecord& piece : found) {
        const auto steps = must(cell_.jobs().history(piece.id));
        RC_ASSERT(steps.empty() == (piece.state == PieceState::kUnfilled));
        if (steps.empty()) continue;
        RC_ASSERT(std::string(to_string(steps.back().state)) == to_string(piece.state));
        RC_ASSERT(steps.back().allocation == piece.allocation);
      }
    }
    for (const ModelJob& job : jobs_) {
      const auto found = must(cell_.jobs().pieces(job.id));
      for (std::size_t i = 0; i < found.size(); ++i)
        RC_ASSERT(found[i].assembled.has_value() ==
                  (job.pieces[i].state == AllocationState::kCut && job.pieces[i].assembled));
    }
    RC_ASSERT(must(cell_.jobs().list()).size() == jobs_.size());
    RC_ASSERT(must(cell_.jobs().queue()) == queue());
    compare_runs();
    compare_verdicts();
    compare_people();
    look_at_a_point();
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
      RC_ASSERT(must(cell_.panels().summaries(panels_[panel])).at(panels_[panel]).open_differences ==
                std::count_if(differences_.begin(), differences_.end(),
                              [&](const auto& d) { return d.panel == panel && d.open; }));
    }
  }
  // Called with every connection that is opened, and with the one that is open.
  void on_open(std::function<void(Database&)> told) {
    opened_ = std::move(told);
    opened_(cell_.database());
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
    std::optional<Cell> outline = std::nullopt;  // where the piece's outline lies, if in it
  };
  std::vector<Wood> wood_on(int panel) const {
    std::vector<Wood> out;
    const auto add = [&](const ModelPiece& piece, bool box) {
      if (piece.panel == panel && piece.state != AllocationState::kReleased)
        out.push_back(
            {piece.state, piece.cells, box,
             piece.cells.contains(piece.outline_cell()) ? std::optional(piece.outline_cell()) : std::nullopt});
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
  // Of a run that is over, mostly: several pieces are needed for some to be made again at once.
  void cut_some_and_redo() {
    if (!run_) start_run();
    for (int pieces = 0; pieces < 4; ++pieces) mark_cutting(), book();
    if (run_) finish(false);
    redo();
  }
  // Mostly some of it was seen.
  void look_and_settle() {
    for (int looks = *in_range(0, 4); looks > 0; --looks) look_at_a_piece();
    settle_as_seen();
  }
  void scan_or_stray() { *in_range(0, 4) == 0 ? scan_again() : stray(); }
  // Another program writes: before the check nothing is booked and no job begins, and what runs goes on.
  void doubt_and_check() {
    RC_ASSERT(db::stray(cell_.file(), "CREATE TABLE notes (line TEXT); DROP TABLE notes").empty());
    doubted_ = true;
    constexpr std::array<void (ModelledCell::*)(), 7> kTried = {
        &ModelledCell::create,    &ModelledCell::create_from_plan, &ModelledCell::lease, &ModelledCell::redo,
        &ModelledCell::start_run, &ModelledCell::mark_cutting,     &ModelledCell::book};
    for (int i = 0; i < 6; ++i) (this->*kTried[*in_range<std::size_t>(0, kTried.size())])();
    RC_ASSERT(sound());
    doubted_ = false;
  }
  void archive_some() { *in_range(0, 4) == 0 ? archive_what_is_done() : archive(); }
  void restoration_or_scan() { *in_range(0, 6) == 0 ? note_restoration() : scan_again(); }
  // What was cut at this point of this panel.
  void look_at_a_point() {
    const int panel = any_panel();
    const Cell cell{*in_range(0, kGrid), *in_range(0, kGrid)};
    std::vector<std::string> wanted, found;
    for (const Wood& wood : wood_on(panel))
      if (wood.cells.contains(cell)) wanted.emplace_back(to_string(wood.state));
    const auto middle = point<PanelFrame>((cell.first + 0.5) * kCell, (cell.second + 0.5) * kCell);
    for (const AllocationRecord& wood : must(cell_.ledger().allocations_at(panels_[panel], middle)))
      found.emplace_back(to_string(wood.state));
    RC_ASSERT(found == wanted);
  }
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
  void give(const Command& command) {
    ++given_[command.name];
    (this->*command.give)();
  }
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
    reopen();
    const auto over = fs::copy_options::recursive | fs::copy_options::overwrite_existing;
    if (fs::exists(folder() / "backup" / "plans")) fs::copy(folder() / "backup" / "plans", folder() / "plans", over);
    static_cast<ModelledKnowledge&>(*this) = *backup_;
    ++restored_;
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
  int restored_ = 0;
  std::map<std::string, int> given_;
};

}  // namespace veneer::db
