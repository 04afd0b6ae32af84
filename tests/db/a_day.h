// A day at the cell: every kind of transaction that the stores make, at least once, one after the other. A new
// operation of a store is a new step here, and is then tried under every fault of the disk and of memory.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "db/accounts.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "db/differences.h"
#include "db/later_scans.h"
#include "db/leases.h"
#include "db/masks.h"
#include "db/materials.h"
#include "db/proposals.h"
#include "db/remnant_book.h"
#include "db/stock_facts.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

struct Step {
  std::string name;
  std::function<Status(Database&)> take;
  Status operator()(Database& database) const { return take(database); }
};

template <class T>
Status dropped(const Result<T>& result) {
  return result.ok() ? Ok() : Status(result.error());
}
inline Status dropped(Status status) { return status; }

// Ids are what a fresh database hands out; they stand beside the steps that make them.
inline std::vector<Step> a_day() {
  const PanelId oak{"P-0001"}, ash{"P-0002"}, elm{"P-0003"};
  const KeyedRequest request{"local:1000", "newJob", "k-1", "hash"}, forgotten{"local:1000", "newJob", "k-2", "hash"};
  std::vector<Step> day;
  const auto add = [&day](std::string name, auto take) {
    day.push_back({std::move(name), [take](Database& database) { return dropped(take(database)); }});
  };
  const auto jobs = [&add](std::string name, auto take) {
    add(std::move(name), [take](Database& database) { return take(JobStore(database)); });
  };
  const auto mark = [&](int piece) {
    jobs("cutting", [piece](JobStore store) { return store.mark_cutting({piece}, kNow); });
  };
  const auto book = [&](int piece) {
    jobs("cut", [piece](JobStore store) { return store.book_piece({piece}, kNow); });
  };
  const auto run = [&](int job, const PanelId& panel) {
    jobs("run", [job, panel](JobStore store) {
      return store.start_run({job}, panel, {}, 0.05_mm, kNow,
                             {"local:1000", {{1}}, R"([{"material":"walnut"}])", true});
    });
  };
  const auto finish = [&](int number) {
    jobs("finish", [number](JobStore store) { return store.finish_run({number}, true, kLater); });
  };
  const auto settle = [&](int piece, AllocationState verdict) {
    jobs("settle", [=](JobStore store) { return store.settle({piece}, verdict, kLater, "user anna"); });
  };

  add("panel", [=](Database& db) {
    ScanRecord scan;
    scan.panel = oak, scan.device = "twin:1", scan.file = "scans/1.png", scan.sha256 = "ab12", scan.dpi = 600;
    scan.rms = 0.012_mm, scan.lattice = "[[1,0],[0,1]]", scan.taken_at = kNow;
    FiducialRecord tag;
    tag.tag_id = 201, tag.corners = square(5, 5, 8);
    return Panels(db).add(sheet(oak), {scan}, {tag});
  });
  add("panel", [=](Database& db) { return Panels(db).add(sheet(ash), {}, {}); });
  add("zones", [=](Database& db) {
    return Materials(db).add_zones(oak, {{1, Region<PanelFrame>(square(10, 10, 100)), "", 0.75},
                                         {2, Region<PanelFrame>(square(120, 10, 100)), ""}});
  });
  add("material", [=](Database& db) { return Materials(db).set_material(oak, 2, "walnut"); });
  add("zone drawn", [=](Database& db) {
    return dropped(
        Materials(db).draw_zone(oak, std::nullopt, Region<PanelFrame>(square(300, 200, 20)), "local:1000", kNow));
  });
  for (const char* wood : {"walnut", "maple"})
    add("recipe", [=](Database& db) {
      RecipeRecord recipe;
      recipe.material = wood, recipe.speed = MmPerSecond(12), recipe.power = PowerFraction(0.65);
      recipe.kerf = KerfRecord{0.21_mm, 0.17_mm}, recipe.changed_at = kNow;
      return Materials(db).set_recipe(recipe);
    });
  add("recipe removed", [](Database& db) { return Materials(db).remove_recipe("maple", Operation::kCut); });
  add("certificate", [](Database& db) {
    return Certificates(db).issue({{}, CertificateKind::kKerf, kNow, kLater, 0.01_mm, "{}"});
  });
  add("laser", [](Database& db) { return Certificates(db).laser_is("Grbl 1.1h, $100=80", kNow); });

  const auto proven = [&](int number) {
    jobs("panel seen where it has to lie", [number](JobStore store) { return store.note_proof({number}, kNow); });
  };

  // Job 1 has pieces 1 to 4 and comes of plan 1, job 2 has piece 5.
  jobs("job", [=](JobStore store) {
    return store.create(job_of({square_piece("A1", oak, 10, 10, 14), square_piece("A2", oak, 30, 10, 14),
                                square_piece("A3", oak, 50, 10, 14), square_piece("A4", ash, 10, 10, 14)}),
                        kNow);
  });
  jobs("job", [=](JobStore store) { return store.create(job_of({square_piece("B1", ash, 100, 10, 14)}), kNow); });
  for (const bool first : {true, false})
    jobs("queue", [first](JobStore store) {
      return store.put_before({2}, first ? std::optional(JobId{1}) : std::nullopt, "local:1000", kNow);
    });
  run(1, oak);
  mark(1);
  book(1);
  mark(2);
  jobs("broken off", [](JobStore store) { return store.abort_run({1}, {}, "stop", kLater, {}, "local:1000"); });
  for (const auto verdict : {AllocationState::kScrap, AllocationState::kSuspect, AllocationState::kScrap})
    settle(2, verdict);
  run(1, oak);
  mark(3);
  book(3);
  proven(2);
  finish(2);
  run(1, ash);
  mark(4);
  book(4);
  finish(3);
  jobs("cancel", [](JobStore store) { return store.cancel({2}, kLater); });

  // Plan 3. Piece 2 lies elsewhere from now on, job 1 is stopped.
  jobs("redo", [=](JobStore store) { return store.redo({1}, job_of({square_piece("A2", oak, 70, 10, 14)}), kLater); });
  run(1, oak);
  jobs("broken off, others in doubt", [](JobStore store) {
    const std::vector<PieceId> suspects = {{2}}, neighbours = {{1}};
    return store.abort_run({4}, suspects, "the belt slipped", kLater, neighbours);
  });
  settle(1, AllocationState::kCut);
  settle(2, AllocationState::kReleased);
  jobs("in doubt", [](JobStore store) {
    const std::vector<PieceId> pieces = {{3}};
    return store.make_suspect(pieces, kLater);
  });
  settle(3, AllocationState::kCut);

  // Plan 4, job 3 of it has pieces 6 and 7.
  add("mask", [=](Database& db) {
    return Panels(db).add_mask(ash, {0, "map", "mask", "hash", kLater, SquareMillimetres(1234.5)}, 1);
  });
  add("plan", [=](Database& db) {
    NewPlan plan = job_of({square_piece("C1", ash, 200, 10, 14), square_piece("C2", ash, 230, 10, 14)});
    plan.planned_on[0].mask_version = 2;
    plan.parent = PlanId{2};
    return Plans(db).add(plan, kLater);
  });
  add("key", [=](Database& db) { return RequestKeys(db).begin(request, kLater); });
  jobs("job of a plan", [=](JobStore store) { return store.create(PlanId{4}, kLater, request, "local:1000"); });
  jobs("cancel", [](JobStore store) { return store.cancel({3}, kLater); });

  // Plan 5, job 4 has pieces 8 and 9 on two panels; its runs are 5 to 8.
  jobs("job", [=](JobStore store) {
    NewPlan plan = job_of({square_piece("D1", oak, 90, 10, 14), square_piece("D2", ash, 30, 10, 14)});
    plan.planned_on[1].mask_version = 2;
    return store.create(plan, kLater);
  });
  run(4, oak);
  mark(8);
  jobs("cut and kept", [](JobStore store) {
    return store.book_and_keep(KeptCut{{8}, "", {5}, "Grbl 1.1h, $100=80", R"([{"speed":12}])"}, kNow);
  });
  finish(5);
  jobs("kept cuts forgotten", [](JobStore store) { return store.forget_cuts(); });
  add("remnant", [=](Database& db) {
    const RemnantRecord::Room room{point<PanelFrame>(110, 30), 90_mm};
    return RemnantBook(db).book({{},
                                 oak,
                                 1,
                                 RunId{5},
                                 "ab12",
                                 {{"walnut", SquareMillimetres(812.5)}},
                                 room,
                                 room,
                                 {},
                                 "panels/P-0001/left.png",
                                 kLater});
  });
  jobs("broken off between panels", [](JobStore store) { return store.abort_job({4}, kLater, "local:1000"); });
  run(4, ash);
  finish(6);
  jobs("stopped between panels", [](JobStore store) { return store.stop_job({4}, kLater, "local:1000"); });
  jobs("job under way", [](JobStore store) { return store.note_under_way("in the middle of job 4", kLater); });
  run(4, ash);
  finish(7);
  jobs("stopped between panels, at rest",
       [](JobStore store) { return store.stop_job_and_rest({4}, kLater, "", "local:1000"); });
  run(4, ash);
  mark(9);
  jobs("recovery", [](JobStore store) { return store.recover(kLater); });
  jobs("cleared", [](JobStore store) { return store.note_cleared("local:1000", kLater); });
  jobs("homing", [](JobStore store) { return store.note_under_way("while the laser was homed", kLater); });
  jobs("homed", [](JobStore store) { return store.note_at_rest(kLater); });
  jobs("jogging", [](JobStore store) { return store.note_under_way("while the head was jogged", kLater); });
  jobs("STOP", [](JobStore store) { return store.note_abort("STOP by local:1000", kLater, "local:1000"); });
  add("sighting", [=](Database& db) -> Status {
    const auto piece = JobStore(db).find_piece(PieceId{9});
    if (!piece.ok()) return piece.error();
    const std::pair seen(piece->allocation, Sighting{Seen::kStillThere, 0.01, 1, kLater});
    return JobStore(db).note_sightings({&seen, 1});
  });
  jobs("assembled", [](JobStore store) -> Status {
    const auto piece = store.find_piece(PieceId{8});
    if (!piece.ok()) return piece.error();
    return store.assemble(piece->job, std::vector{piece->mark}, true, "local:1000", kLater);
  });
  const auto difference = [](bool gone, double x, double y) {
    DifferenceRecord found;
    found.gone = gone, found.place = point<PanelFrame>(x + 1, y + 1), found.area = SquareMillimetres(9.5);
    found.shape = rectangle(x, y, 4, 3);
    return found;
  };
  const auto proposal = [](std::vector<int> tags) {
    ProposalRecord out;
    out.who = "local:1000", out.made_at = kLater, out.map_file = "proposals/map", out.mask_file = "proposals/mask";
    out.read_file = "proposals/read", out.read_sha256 = std::string(64, 'a'), out.scan_files = {"scans/9.png"};
    out.tags = std::move(tags), out.width = 420_mm, out.height = 280_mm;
    return out;
  };
  // Proposal 1, difference 1, and the third version of this panel's mask.
  add("proposal", [=](Database& db) {
    ProposalRecord known = proposal({});
    known.panel = ash, known.after = 2;
    known.asked = {{1, square(300, 200, 5), 0.25, false, "it looks like the board"}};
    return Proposals(db).add(known);
  });
  add("proposal of a known panel accepted", [=](Database& db) -> Status {
    const auto piece = JobStore(db).find_piece(PieceId{9});
    if (!piece.ok()) return piece.error();
    ScanRecord look;
    look.panel = ash, look.device = "twin:3", look.file = "scans/9.png", look.sha256 = "ef56", look.dpi = 600;
    look.lattice = "[[1,0],[0,1]]", look.taken_at = kLater;
    FiducialRecord tag;
    tag.tag_id = 301, tag.corners = square(5, 5, 8);
    const LaterScan scan{{0, "proposals/map", "proposals/mask", "hash", kLater, SquareMillimetres(1200)},
                         2,
                         {{1, Region<PanelFrame>(square(10, 10, 100)), ""}},
                         {{difference(true, 200, 200)}},
                         false,
                         {{piece->allocation, {Seen::kStillThere, 0.01, 0, kLater}}},
                         {look},
                         {tag}};
    return dropped(LaterScans(db).enter(ash, scan, Acceptance{{1}, {"lost-wood"}, "local:1000"}));
  });
  jobs("settled as seen", [](JobStore store) {
    return store.settle_as_seen({4}, {AllocationState::kReleased, std::vector<std::string>{"D2"}}, "local:1000",
                                kLater);
  });

  add("written off", [=](Database& db) {
    return Ledger(db).write_off(oak, Region<PanelFrame>(square(300, 200, 20)), "burnt pattern", kNow);
  });
  add("written off where nothing is booked", [=](Database& db) {
    return Ledger(db).write_off_free(oak, rectangle(290, 195, 20, 20), "a scorched rim", kNow);
  });
  add("differences", [=](Database& db) {
    return Differences(db).found(oak, {difference(true, 350, 10), difference(false, 25, 45), difference(true, 300, 50)},
                                 kNow);
  });
  add("difference written off", [=](Database& db) {
    return Differences(db).decide(oak, {2}, DifferenceVerdict::kWrittenOff, "local:1000", "a chip", kLater);
  });
  add("difference accepted", [=](Database& db) {
    return Differences(db).decide(oak, {3}, DifferenceVerdict::kAccepted, "local:1000", "", kLater);
  });
  add("differences not seen again", [=](Database& db) { return Differences(db).found(oak, {}, kLater); });
  add("mask taken back", [=](Database& db) { return Panels(db).revert_mask(ash, 1, kLater); });
  add("proposal", [=](Database& db) { return Proposals(db).add(proposal({401})); });
  add("proposal replaced", [=](Database& db) { return Proposals(db).add(proposal({401, 402})); });
  add("proposal refused", [=](Database& db) { return Proposals(db).refuse({3}, "local:1000", "dust", kLater); });
  const auto painted = [](const char* file) {
    return MaskRecord{0, "map", file, "hash", kLater, SquareMillimetres(1200), "mask"};
  };
  add("mask edited", [=](Database& db) {
    return Masks(db).add(ash, {{}, true, rectangle(300, 200, 5, 5), "local:1000", "", kLater, {}}, painted("given"), 4);
  });
  add("edit taken back",
      [=](Database& db) { return Masks(db).remove(ash, {1}, "local:1000", kLater, painted("mask"), 5); });
  add("scan", [=](Database& db) {
    ScanRecord scan;
    scan.panel = ash, scan.face = Face::kBack, scan.device = "twin:2", scan.file = "scans/2.png", scan.sha256 = "cd34";
    scan.dpi = 600, scan.lattice = "[[1,0],[0,1]]", scan.taken_at = kLater;
    FiducialRecord hole;
    hole.kind = FiducialKind::kHole, hole.tag_id = 0, hole.face = Face::kBack, hole.corners = {point<PanelFrame>(9, 9)};
    FiducialRecord tag;
    tag.tag_id = 302, tag.corners = square(405, 5, 8);
    return Panels(db).add_scans(ash, {scan}, {hole}, {tag});
  });

  add("plan", [=](Database& db) { return Plans(db).add(job_of({square_piece("E1", oak, 10, 100, 14)}), kLater); });
  add("plan removed", [](Database& db) { return Plans(db).remove(PlanId{6}); });
  add("panel", [=](Database& db) { return Panels(db).add(sheet(elm), {}, {}); });
  add("retired", [=](Database& db) { return Panels(db).retire(elm, "split in two", kNow, "user anna"); });
  add("restored", [=](Database& db) { return Panels(db).restore(elm, "glued", kLater, "user anna"); });
  add("archived", [](Database& db) { return JobStore(db).archive_done(kNow, "user anna"); });
  for (const bool away : {false, true})
    jobs(away ? "out of sight" : "back in sight",
         [away](JobStore store) { return store.archive({2}, away, kLater, "user anna"); });
  const PanelId beech{"P-0004"};
  add("panel", [=](Database& db) { return Panels(db).add(sheet(beech), {}, {}); });
  add("written off", [=](Database& db) {
    return Ledger(db).write_off(beech, Region<PanelFrame>(square(30, 20, 20)), "burnt pattern", kNow);
  });
  add("sawn apart", [=](Database& db) { return Panels(db).split(beech, "test", "sawn apart", kLater); });
  add("part", [=](Database& db) {
    PanelRecord part = sheet({"P-0005"});
    part.parent = beech;
    return Panels(db).add_part(part, {}, {}, {{degrees(3), point<PanelFrame>(-20, 4)}, 3, 0.02_mm}, {},
                               {{1, Region<PanelFrame>(square(10, 10, 100)), "walnut"}});
  });
  const PanelId yew{"P-0006"}, yew_again{"P-0007"};
  for (const PanelId& panel : {yew, yew_again}) {
    add("proposal", [=](Database& db) { return Proposals(db).add(proposal({501})); });
    add("proposal accepted", [=](Database& db) {
      const Acceptance accepted{{panel == yew ? 4 : 5}, {"size"}, "local:1000"};
      const auto enter = [&] {
        return Panels(db).add(sheet(panel), {}, {}, accepted, {{1, Region<PanelFrame>(square(10, 10, 100)), ""}});
      };
      // The first as with answers to what it asks.
      return panel == yew ? Masks(db).add_behind(panel, enter, {}) : enter();
    });
    add("written off", [=](Database& db) {
      return Ledger(db).write_off(panel, rectangle(panel == yew ? 30 : 90, 20, 20, 20), "burnt pattern", kNow);
    });
  }
  add("merged", [=](Database& db) {
    return Panels(db).merge({yew, yew_again, {degrees(1), point<PanelFrame>(2, 1)}, 4, 0.01_mm, "test", kLater}, {},
                            {});
  });
  add("key", [=](Database& db) { return RequestKeys(db).begin(forgotten, kNow); });
  add("key forgotten", [=](Database& db) { return RequestKeys(db).forget(forgotten); });
  add("key", [=](Database& db) { return RequestKeys(db).begin(forgotten, kNow); });
  add("keys pruned", [](Database& db) { return RequestKeys(db).prune(kLater); });
  const UserRecord anna{"anna", "operator", "$argon2id$v=19$x", kNow, kNow};
  const auto credential = [](char letter, const std::string& kind) {
    return CredentialRecord{
        std::string(64, letter), kind, "anna", std::string("press room ") + letter, "viewer", kNow, kLater};
  };
  add("account", [=](Database& db) { return Accounts(db).add(anna); });
  for (const char letter : {'a', 'b', 'c'})
    add("signed in",
        [=](Database& db) { return Accounts(db).add(credential(letter, letter == 'a' ? "session" : "token")); });
  add("token revoked", [](Database& db) { return Accounts(db).end({std::string(64, 'b')}); });
  add("another role", [=](Database& db) {
    return Accounts(db).change({anna.name, "viewer", anna.password, anna.made_at, kLater});
  });
  add("account removed", [=](Database& db) { return Accounts(db).remove(anna.name); });
  add("everybody out", [](Database& db) { return Accounts(db).end_all(); });
  add("account", [=](Database& db) { return Accounts(db).add(anna); });
  add("signed in", [=](Database& db) { return Accounts(db).add(credential('d', "session")); });
  add("wood described", [](Database& db) {
    return StockFacts(db).set_material({"walnut", "Juglans regia", "France", "Miller", "not_listed", "test", kLater});
  });
  add("panel described", [=](Database& db) {
    return StockFacts(db).set_panel(oak, {"A3", 0.6_mm, 1.5_mm, "test", kLater},
                                    {{TreatmentKind::kFinish, "shellac", "2026-05-01", "", ""}});
  });
  // Plans 7 and 8; the first one's wood becomes that of job 5.
  const auto leased = [&](int plan, const std::string& until) {
    add("leased", [=](Database& db) { return Leases(db).take({plan}, "local:1000", kNow, until); });
  };
  const std::string next_week = "2026-05-08T07:30:00.000Z";
  add("plan", [=](Database& db) {
    return Plans(db).add(job_of({square_piece("F1", elm, 10, 10, 14), square_piece("F2", elm, 30, 10, 14)}), kNow);
  });
  leased(7, kLater);
  leased(7, next_week);  // renewed
  add("released", [](Database& db) { return Leases(db).release({7}, kLater, "user anna"); });
  leased(7, kLater);
  add("expired", [](Database& db) { return Leases(db).expire(kLater); });
  leased(7, next_week);
  jobs("job of a leased plan", [](JobStore store) { return store.create(PlanId{7}, kLater); });
  add("plan", [=](Database& db) { return Plans(db).add(job_of({square_piece("G1", elm, 100, 10, 14)}), kLater); });
  leased(8, next_week);
  add("difference", [=](Database& db) { return Differences(db).found(elm, {difference(true, 102, 12)}, kLater); });
  add("leased wood written off", [=](Database& db) {
    return Differences(db).decide(elm, {5}, DifferenceVerdict::kWrittenOff, "local:1000", "a chip", kLater);
  });
  // Job 5's first piece, in run 9, whose cuts are still kept at the day's end.
  run(5, elm);
  jobs("cutting", [](JobStore store) -> Status {
    const auto pieces = store.pieces(JobId{5});
    return pieces.ok() ? store.mark_cutting(pieces->front().id, kNow) : Status(pieces.error());
  });
  jobs("cut and kept", [](JobStore store) -> Status {
    const auto pieces = store.pieces(JobId{5});
    if (!pieces.ok()) return pieces.error();
    return store.book_and_keep({pieces->front().id, "", {9}, "Grbl 1.1h, $100=80", R"([{"speed":12}])"}, kNow);
  });
  add("restored from a backup", [](Database& db) { return Panels(db).note_restoration(kNow, "test", kLater); });
  add("audit", [](Database& db) { return Audit(db).append({0, kLater, "test", "day.end", ""}); });
  return day;
}

}  // namespace veneer::db
