// A process that does whatever a cell does, drawn from a seed and from what the database says: the same seed on the
// same database does the same. Each step is one transaction.
#pragma once

#include <algorithm>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "db/differences.h"
#include "db/later_scans.h"
#include "db/leases.h"
#include "db/masks.h"
#include "db/shapes.h"
#include "tests/db/busy_office.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

class BusyProcess {
 public:
  BusyProcess(Database& database, std::uint32_t seed)
      : database_(database), jobs_(database), panels_(database), random_(seed) {}

  // The first step is the recovery, as at every start. kConflict when the wood is taken, kRefused while a scan waits to
  // be decided or a panel to be scanned, kNotFound where it asks for a version that is not there: answers like others.
  Status step() {
    if (!std::exchange(recovered_, true)) {
      const auto found = jobs_.recover(kLater);
      if (!found.ok()) return failed("recovery");
      clear_owed_ = found->clear_owed.has_value();
      return Ok();
    }
    if (below(6) == 0) return office_.step(some_panel());
    const auto run = row("SELECT id FROM runs WHERE ended_at IS NULL");
    return run ? cut({*run}) : prepare();
  }

  // By the last abort or Clear that was acknowledged, or by the recovery: another start finds it so, or with more.
  bool clear_owed() const { return clear_owed_; }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  static Status failed(const std::string& what) { return Error{ErrorCode::kStorage, what + " failed"}; }

  // One of the numbers that the query finds.
  std::optional<std::int64_t> row(const std::string& query) {
    SQLite::Statement rows(database_.connection(), query);
    std::vector<std::int64_t> all;
    while (rows.executeStep()) all.push_back(rows.getColumn(0).getInt64());
    if (all.empty()) return std::nullopt;
    return all[below(static_cast<unsigned>(all.size()))];
  }

  Status cut(RunId run) {
    const auto cutting = row("SELECT piece FROM allocations WHERE state = 'cutting'");
    if (below(12) == 0) return jobs_.abort_run(run, {}, "stop", kLater, {}, "local:1000");
    if (below(8) == 0) return jobs_.note_proof(run, kNow);
    if (cutting && below(2) == 0) return jobs_.book_and_keep({{*cutting}, "", run, "Grbl 1.1h", "[]"}, kNow);
    if (cutting) return jobs_.book_piece({*cutting}, kNow);
    const auto next =
        row("SELECT a.piece FROM allocations AS a JOIN runs AS r ON r.job = a.job AND r.panel = a.panel WHERE "
            "r.ended_at IS NULL AND a.state = 'reserved'");
    if (!next || below(12) == 0) return jobs_.finish_run(run, below(2) == 0, kLater, {{}, below(2) == 0, "local:1000"});
    return jobs_.mark_cutting({*next}, kNow);
  }

  // Of all that are in stock; never none.
  PanelRecord some_panel() {
    const auto stock = must(panels_.in_stock());
    return stock[below(static_cast<unsigned>(stock.size()))];
  }
  Point<PanelFrame> some_place() {
    const double x = 2 + kCell * below(26);
    return point<PanelFrame>(x, 2 + kCell * below(17));
  }
  PlannedPatch somewhere(const std::string& mark) {
    const PanelId panel = some_panel().id;
    const auto place = some_place();
    return square_piece(mark, panel, place.x.count(), place.y.count(), 14);
  }
  NewPlan plan_of(const std::vector<PlannedPatch>& pieces) {
    NewPlan plan = job_of(pieces);
    for (auto& on : plan.planned_on) on.mask_version = must(panels_.find(on.panel)).mask_version;
    return plan;
  }
  NewPlan some_plan() {
    std::vector<PlannedPatch> pieces;
    for (unsigned i = 0, n = 1 + below(5); i < n; ++i) pieces.push_back(somewhere(fmt::format("A{}", i)));
    return plan_of(pieces);
  }
  Status reserve() {
    const auto made = jobs_.create(some_plan(), kNow);
    return made.ok() ? Ok() : Status(made.error());
  }
  // A plan is kept, leases its wood, and gives it back, to a job of its own or to nobody.
  Status lease() {
    Leases leases(database_);
    if (const auto leased = row("SELECT plan FROM leases WHERE ended IS NULL")) {
      const unsigned what = below(5);
      if (what < 2) return leases.release({*leased}, kLater, "local:1000");
      if (what == 2) return leases.expire("2026-06-01T00:00:00.000Z").ok() ? Ok() : failed("expiry");
      if (what == 3) return dropped(jobs_.create(PlanId{*leased}, kNow, {}, "local:1000"));
    }
    const auto kept = row(
        "SELECT id FROM plans WHERE id NOT IN (SELECT plan FROM jobs) AND id NOT IN (SELECT plan FROM redos) AND id "
        "NOT IN (SELECT plan FROM leases WHERE ended IS NULL) ORDER BY id DESC LIMIT 1");  // few are outdated
    if (kept && below(8) == 0) return Plans(database_).remove({*kept});
    if (!kept || below(3) == 0)
      return dropped(Plans(database_).add(below(2) == 0 ? some_plan() : plan_of({somewhere("A0")}), kNow));
    const auto taken = leases.take({*kept}, "local:1000", kNow, below(4) == 0 ? kLater : "2026-05-08T07:30:00.000Z");
    return taken.ok() ? Ok() : Status(taken.error());
  }
  Status redo() {
    const auto piece = row(
        "SELECT piece FROM piece_states AS s JOIN jobs AS j ON j.id = s.job WHERE j.state <> 'running' AND s.state IN "
        "('cut', 'scrap', 'released')");
    if (!piece) return reserve();
    const PieceRecord lost = must(jobs_.find_piece({*piece}));
    const auto made = jobs_.redo(lost.job, plan_of({somewhere(lost.mark)}), kLater);
    return made.ok() ? Ok() : Status(made.error());
  }

  // The stock itself: sheets come, are sawn apart, and turn out to be one.
  Status change_stock() {
    const auto stock = must(panels_.in_stock());
    const PanelId fresh = must(panels_.next_panel_id());
    if (stock.size() < kFewestPanels)
      return panels_.add(sheet(fresh), {}, {}, {}, {{1, Region<PanelFrame>(square(10, 10, 100)), ""}});
    const Isometry2<PanelFrame, PanelFrame> moved(Radians(0), point<PanelFrame>(-kCell * below(4), 0));
    const auto sawn = must(panels_.sawn());
    if (below(30) == 0) return panels_.note_restoration(kNow, "local:1000", kLater);
    const unsigned what = below(5);
    if (what == 3) return panels_.retire(some_panel().id, "glued", kLater, "local:1000");
    if (what == 4) {
      const auto gone = row("SELECT rowid FROM panels WHERE id IN (SELECT panel FROM retirements)");
      if (!gone) return panels_.retire(some_panel().id, "glued", kLater);
      SQLite::Statement of(database_.connection(), "SELECT id FROM panels WHERE rowid = ?");
      of.bind(1, *gone);
      of.executeStep();
      return panels_.restore(PanelId{of.getColumn(0).getString()}, "glued", kLater);
    }
    if (what == 0 && !sawn.empty() && stock.size() < kMostPanels) {
      PanelRecord part = sheet(fresh);
      part.parent = sawn[below(static_cast<unsigned>(sawn.size()))];
      return panels_.add_part(part, {}, {}, {moved, 3, 0.02_mm}, {},
                              {{1, Region<PanelFrame>(square(10, 10, 100)), "walnut"}});
    }
    const PanelId one = some_panel().id, other = some_panel().id;
    if (what == 1 && one != other)
      return panels_.merge({one, other, moved.inverse(), 4, 0.01_mm, "local:1000", kLater}, {}, {});
    return panels_.split(one, "local:1000", "sawn apart", kLater);
  }
  // A panel's face is looked at again, and what that shows is stock at once, or a proposal that was accepted.
  Status scan_again() {
    const PanelRecord panel = some_panel();
    LaterScan scan{{0, "map", "mask", "hash", kLater, SquareMillimetres(100.0 * below(900))},
                   panel.mask_version,
                   {},
                   {},
                   false,
                   {},
                   {},
                   {}};
    scan.zones = {{1, Region<PanelFrame>(square(10, 10, 100)), ""}};
    scan.differences.emplace();
    for (unsigned i = 0, n = below(3); i < n; ++i) {
      DifferenceRecord& seen = scan.differences->emplace_back();
      seen.place = some_place(), seen.gone = below(4) != 0, seen.area = SquareMillimetres(16);
      seen.shape = rectangle(seen.place.x.count(), seen.place.y.count(), 4, 4);
    }
    for (const auto& [allocation, state] : must(Ledger(database_).live_states(panel.id)))
      if (state == AllocationState::kSuspect)
        scan.sightings.push_back({allocation, {Seen::kUnclear, 0.01 * below(100), 0, kLater}});
    if (below(8) == 0) return Differences(database_).found(panel.id, *scan.differences, kLater);
    if (below(8) == 0) return dropped(panels_.add_mask(panel.id, scan.mask, panel.mask_version));
    ScanRecord raw;
    raw.panel = panel.id, raw.device = "twin:1", raw.file = fmt::format("scans/{}.png", below(100'000));
    raw.sha256 = "ab12", raw.dpi = 600, raw.lattice = "[[1,0],[0,1]]", raw.taken_at = kLater;
    if (below(8) == 0) return panels_.add_scans(panel.id, {raw}, {}, {});
    scan.scans = {raw};
    if (below(3) != 0) return dropped(LaterScans(database_).enter(panel.id, scan));
    if (const auto waits = row("SELECT id FROM proposals WHERE id NOT IN (SELECT proposal FROM proposal_verdicts)")) {
      const ProposalRecord proposal = must(Proposals(database_).find({*waits}));
      if (below(3) == 0) return Proposals(database_).refuse(proposal.id, "local:1000", "dust", kLater);
      scan.after = *proposal.after;
      for (ScanRecord& one : scan.scans) one.panel = *proposal.panel;
      // With what somebody said of a strip that it asks about.
      MaskEdit edit;
      edit.give = true, edit.shape = rectangle(20, 20, 5, 5), edit.who = "local:1000", edit.at = kLater;
      const MaskRecord painted{0, "map", "painted", "hash", kLater, SquareMillimetres(100.0 * below(900)), "mask"};
      return Masks(database_).add_behind(*proposal.panel,
                                         [&] {
                                           return dropped(LaterScans(database_).enter(
                                               *proposal.panel, scan, Acceptance{proposal.id, {}, "local:1000"}));
                                         },
                                         {{edit, painted}});
    }
    ProposalRecord proposal;
    proposal.panel = panel.id, proposal.after = panel.mask_version, proposal.who = "local:1000";
    proposal.made_at = kLater, proposal.map_file = "map", proposal.mask_file = "mask", proposal.read_file = "read";
    proposal.read_sha256 = std::string(64, 'a'), proposal.width = 420_mm, proposal.height = 280_mm;
    return dropped(Proposals(database_).add(proposal));
  }
  Status decide_difference() {
    const auto open =
        row("SELECT id FROM differences AS d WHERE NOT EXISTS (SELECT 1 FROM difference_verdicts WHERE difference = "
            "d.id)");
    if (!open) return scan_again();
    SQLite::Statement of(database_.connection(), "SELECT panel, kind FROM differences WHERE id = ?");
    of.bind(1, *open);
    of.executeStep();
    const PanelId panel{of.getColumn(0).getString()};
    const bool gone = of.getColumn(1).getString() == "gone_not_booked";
    const auto verdict = gone && below(2) == 0 ? DifferenceVerdict::kWrittenOff : DifferenceVerdict::kAccepted;
    return dropped(Differences(database_).decide(panel, {*open}, verdict, "local:1000", "", kLater));
  }
  Status edit_mask() {
    const PanelRecord panel = some_panel();
    MaskRecord painted{0, "map", "painted", "hash", kLater, SquareMillimetres(100.0 * below(900)), "mask"};
    if (below(4) == 0)
      return dropped(panels_.revert_mask(panel.id, 1 + static_cast<int>(below(3)), kLater, "local:1000"));
    const auto edits = must(Masks(database_).counting(panel.id));
    if (!edits.empty() && below(2) == 0)
      return Masks(database_).remove(panel.id, edits.front().id, "local:1000", kLater, painted, panel.mask_version);
    const auto place = some_place();
    MaskEdit edit;
    edit.give = below(2) == 0, edit.shape = rectangle(place.x.count(), place.y.count(), 5, 5);
    edit.who = "local:1000", edit.at = kLater;
    return dropped(Masks(database_).add(panel.id, edit, painted, panel.mask_version));
  }

  // What is done to jobs and their pieces when nothing is cut.
  Status see_to_jobs() {
    const unsigned what = below(13);
    if (what == 0) return break_off_or_clear();
    if (what == 12) return change_queue();
    if (what >= 10)
      return below(2) == 0 ? jobs_.note_under_way("while the head was jogged", kNow) : jobs_.note_at_rest(kNow);
    if (what == 8)  // called lost by mistake
      if (const auto lost = row("SELECT piece FROM piece_states WHERE state = 'scrap'"))
        return jobs_.settle({*lost}, AllocationState::kSuspect, kLater, "user anna");
    if (what == 3) return jobs_.forget_cuts();
    if (what == 4) return dropped(jobs_.archive_done(kLater, "local:1000"));
    if (what == 5)
      if (const auto job = row("SELECT id FROM jobs"))
        return jobs_.archive({*job}, below(3) != 0, kLater, "local:1000");
    if (what == 6)
      if (const auto doubtful = row("SELECT id FROM allocations WHERE state = 'suspect'")) {
        const std::pair seen(AllocationId{*doubtful},
                             Sighting{below(2) == 0 ? Seen::kCut : Seen::kStillThere, 0.01 * below(9), 1, kLater});
        return jobs_.note_sightings({&seen, 1});
      }
    const auto piece = row("SELECT piece FROM allocations WHERE state = 'cut' AND piece IS NOT NULL");
    if (!piece) return reserve();
    if (below(4) == 0) return jobs_.make_suspect(std::vector{PieceId{*piece}}, kLater);
    const PieceRecord cut = must(jobs_.find_piece({*piece}));
    return jobs_.assemble(cut.job, std::vector{cut.mark}, below(3) != 0, "local:1000", kLater);
  }

  Status change_queue() {
    const auto queue = must(jobs_.queue());
    if (queue.size() < 2) return reserve();
    const auto some = [&] { return queue[below(static_cast<unsigned>(queue.size()))]; };
    const JobId moved = some(), other = some();
    return dropped(jobs_.put_before(moved, other == moved ? std::nullopt : std::optional(other), "user anna", kLater));
  }

  Status break_off_or_clear() {
    const bool clears = below(2) == 0;
    Status noted = clears ? jobs_.note_cleared("local:1000", kLater) : jobs_.note_abort("STOP", kLater, "local:1000");
    if (noted) clear_owed_ = !clears;
    return noted;
  }

  // A scan of the wood as it counts now saw the suspect piece gone, or in the panel; later somebody takes that over.
  Status settle_as_seen(PieceId id) {
    const PieceRecord piece = must(jobs_.find_piece(id));
    if (!piece.sighting || piece.sighting->seen == Seen::kUnclear) {
      const int newest = must(panels_.find(*piece.panel)).mask_version;
      const std::pair seen(piece.allocation,
                           Sighting{below(3) == 0 ? Seen::kStillThere : Seen::kCut, 0.9, newest, kLater});
      return jobs_.note_sightings({&seen, 1});
    }
    AsSeen said;
    if (piece.sighting->seen == Seen::kStillThere) said = {AllocationState::kScrap, {{piece.mark}}};
    return dropped(jobs_.settle_as_seen(piece.job, said, "local:1000", kLater));
  }

  Status prepare() {
    const auto between = row("SELECT id FROM jobs WHERE state = 'running'");
    if (between && below(4) == 0) {
      const unsigned how = below(3);
      return how == 0   ? jobs_.abort_job({*between}, kLater, "local:1000")
             : how == 1 ? jobs_.stop_job({*between}, kLater, "local:1000")
                        : jobs_.stop_job_and_rest({*between}, kLater, "", "local:1000");
    }
    const unsigned what = below(22);
    if (what >= 20) return see_to_jobs();
    if (what >= 18) return change_stock();
    if (what == 17) return decide_difference();
    if (what == 16) return edit_mask();
    if (what >= 14) return scan_again();
    if (what >= 10) return lease();
    if (what < 2) return reserve();
    if (what == 2) return redo();
    if (what == 3)
      if (const auto job = row("SELECT id FROM jobs WHERE state IN ('planned', 'stopped', 'aborted')"))
        return jobs_.cancel({*job}, kLater);
    if (what == 4)
      if (const auto piece = row("SELECT piece FROM allocations WHERE state = 'suspect'")) {
        constexpr AllocationState kVerdicts[] = {AllocationState::kCut, AllocationState::kScrap,
                                                 AllocationState::kReleased};
        if (below(3) == 0) return settle_as_seen(PieceId{*piece});
        return jobs_.settle({*piece}, kVerdicts[below(3)], kLater, "user anna");
      }
    if (what == 5) {
      const PlannedPatch wood = somewhere("");
      if (below(2) == 0)
        return dropped(Ledger(database_).write_off_free(*wood.panel, wood.allocation, "a scorched rim", kLater));
      return Ledger(database_).write_off(*wood.panel, wood.allocation, "a knot", kLater);
    }
    const auto wood = row(
        "SELECT a.id FROM allocations AS a JOIN jobs AS j ON j.id = a.job WHERE a.state = 'reserved' AND j.state NOT "
        "IN ('complete', 'cancelled')");
    if (!wood) return reserve();
    SQLite::Statement of(database_.connection(), "SELECT job, panel FROM allocations WHERE id = ?");
    of.bind(1, *wood);
    of.executeStep();
    const auto run = jobs_.start_run({of.getColumn(0).getInt64()}, PanelId{of.getColumn(1).getString()}, {}, 0.05_mm,
                                     kNow, {"local:1000", {}, "[]", below(2) == 0});
    return run.ok() ? Ok() : Status(run.error());
  }

  template <class T>
  static Status dropped(const Result<T>& result) {
    return result.ok() ? Ok() : Status(result.error());
  }

  static constexpr double kCell = 16;
  static constexpr std::size_t kFewestPanels = 2, kMostPanels = 5;

  Database& database_;
  JobStore jobs_;
  Panels panels_;
  std::mt19937 random_;
  BusyOffice office_{database_, random_};
  bool recovered_ = false, clear_owed_ = false;
};

}  // namespace veneer::db
