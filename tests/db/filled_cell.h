// A cell after some days of work, with rows in every table and wood in every state.
#pragma once

#include "db/accounts.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "db/differences.h"
#include "db/leases.h"
#include "db/masks.h"
#include "db/materials.h"
#include "db/proposals.h"
#include "db/remnant_book.h"
#include "db/stock_facts.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

inline FiducialRecord tag_at(int id, double x_mm, double y_mm) {
  FiducialRecord tag;
  tag.tag_id = id;
  tag.corners = square(x_mm, y_mm, 8);
  return tag;
}

inline void fill(CellDatabase& cell) {
  const PanelId oak = must(cell.panels().next_panel_id());
  ScanRecord scan;
  scan.panel = oak;
  scan.device = "twin:1", scan.file = "scans/1.png", scan.sha256 = "ab12", scan.dpi = 600, scan.rms = 0.012_mm;
  scan.max = 0.04_mm, scan.lattice = "[[1,0],[0,1]]", scan.taken_at = kNow;
  VENEER_ASSERT_OK(cell.panels().add(sheet(oak), {scan}, {tag_at(201, 5, 5), tag_at(202, 400, 5)}));
  const PanelId ash = cell.new_panel();
  must(cell.panels().add_mask(ash, {0, "maps/2.png", "maps/2-mask.png", "4567", kLater, SquareMillimetres(1234.5)}, 1));
  Materials materials(cell.database());
  VENEER_ASSERT_OK(materials.add_zones(oak, {{1, Region<PanelFrame>(square(10, 10, 100)), "", 0.75},
                                             {2, Region<PanelFrame>(square(120, 10, 100)), ""}}));
  must(materials.draw_zone(ash, std::nullopt, Region<PanelFrame>(square(10, 10, 50)), "local:1000", kNow));
  VENEER_ASSERT_OK(materials.set_material(oak, 2, "walnut"));
  RecipeRecord recipe;
  recipe.material = "walnut", recipe.speed = MmPerSecond(12), recipe.power = PowerFraction(0.65), recipe.passes = 2;
  recipe.kerf = KerfRecord{0.21_mm, 0.17_mm}, recipe.changed_at = kNow;
  VENEER_ASSERT_OK(materials.set_recipe(recipe));
  StockFacts facts(cell.database());
  VENEER_ASSERT_OK(
      facts.set_material({"walnut", "Juglans regia", "France", "Miller", "not_listed", "local:1000", kNow}));
  VENEER_ASSERT_OK(facts.set_panel(oak, {"A3", 0.6_mm, 1.5_mm, "local:1000", kNow},
                                   {{TreatmentKind::kSanding, "grit 240", "2026-04-30", "", ""}}));
  Certificates certificates(cell.database());
  must(certificates.issue({{}, CertificateKind::kKerf, kNow, kLater, 0.01_mm, "{\"kerf_mm\":0.2}"}));
  must(certificates.issue({{}, CertificateKind::kCamera, kNow, kLater, 0.05_mm, "{\"k\":[1,2,3]}"}));
  VENEER_ASSERT_OK(certificates.laser_is("Grbl 1.1h, $100=80", kNow));

  auto jobs = cell.jobs();
  std::vector<PlannedPatch> patches;
  for (int i = 0; i < 6; ++i)
    patches.push_back(square_piece(fmt::format("A1-{}", i + 1), oak, 20 + 30 * i, 40 + 0.123 * i, 14));
  patches[2].lead_in = point<PanelFrame>(79, 39);
  patches[2].allocation = unite(patches[2].allocation, rectangle(78.9, 38.9, 0.3, 1.5));
  const JobId first = must(jobs.create(job_of(patches), kNow));
  const auto pieces = must(jobs.pieces(first));
  const RunId run = must(jobs.start_run(
      first, oak, Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(400, 300), Handedness::kImproper),
      0.04_mm, kNow, {"local:1000", {{1}, {2}}, R"([{"material":"walnut"}])", true}));
  for (const std::size_t i : {0, 1, 2}) {
    VENEER_ASSERT_OK(jobs.mark_cutting(pieces[i].id, kNow));
    VENEER_ASSERT_OK(jobs.book_piece(pieces[i].id, kLater));
  }
  const std::vector<PieceId> suspects = {pieces[3].id, pieces[4].id};
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[5].id, kNow));
  VENEER_ASSERT_OK(
      jobs.book_and_keep(KeptCut{pieces[5].id, "", run, "Grbl 1.1h, $100=80", R"([{"speed":12}])"}, kLater));
  VENEER_ASSERT_OK(jobs.note_under_way("in the middle of job 1", kNow));
  VENEER_ASSERT_OK(jobs.note_abort("the lid was opened", kLater));
  VENEER_ASSERT_OK(jobs.abort_run(run, suspects, "the lid was opened", kLater));
  VENEER_ASSERT_OK(jobs.note_cleared("local:1000", kLater));
  RemnantBook book(cell.database());
  VENEER_ASSERT_OK(book.book({{},
                              oak,
                              1,
                              run,
                              "ab12",
                              {{"", SquareMillimetres(9)}, {"walnut", SquareMillimetres(812.5)}},
                              RemnantRecord::Room{point<PanelFrame>(200, 10), 90_mm},
                              RemnantRecord::Room{point<PanelFrame>(250, 60), 48_mm},
                              {{"0 14 ", SquareMillimetres(640)}},
                              "panels/P-0001/left.png",
                              kLater}));
  const std::pair seen(pieces[4].allocation, Sighting{Seen::kCut, 0.98, 1, kLater});
  VENEER_ASSERT_OK(jobs.note_sightings({&seen, 1}));
  VENEER_ASSERT_OK(jobs.settle(pieces[3].id, AllocationState::kScrap, kLater, "user anna"));
  VENEER_ASSERT_OK(jobs.assemble(first, std::vector{pieces[1].mark, pieces[2].mark}, true, "local:1000", kLater));
  VENEER_ASSERT_OK(jobs.assemble(first, std::vector{pieces[2].mark}, false, "local:1000", kLater));
  must(jobs.redo(first, job_of({square_piece("A1-4", oak, 20, 190, 14)}), kLater));
  NewPlan second = job_of({square_piece("B1", oak, 20, 100, 14), square_piece("B2", ash, 20, 40, 14)});
  for (auto& panel : second.planned_on)
    if (panel.panel == ash) panel.mask_version = 2;
  const JobId given_up = must(jobs.create(second, kNow));
  VENEER_ASSERT_OK(jobs.cancel(given_up, kLater, "user anna"));
  must(jobs.create(must(jobs.find(given_up)).plan, kLater, {}, "user anna"));
  VENEER_ASSERT_OK(jobs.archive(given_up, true, kLater, "user anna"));
  must(jobs.put_before(first, std::nullopt, "local:1000", kLater));
  VENEER_ASSERT_OK(cell.ledger().write_off(oak, Region<PanelFrame>(square(300, 200, 20)), "burnt pattern", kNow));
  Plans plans(cell.database());
  NewPlan only_looked_at = job_of({square_piece("C1", oak, 20, 150, 14)});
  only_looked_at.parent = PlanId{1};
  must(plans.add(only_looked_at, kLater));
  Leases leases(cell.database());
  const PlanId leased = must(plans.add(job_of({square_piece("D1", oak, 60, 150, 14)}), kLater));
  must(leases.take(leased, "local:1000", kNow, kLater));
  must(leases.expire(kLater));
  must(leases.take(leased, "local:1000", kLater, "2026-05-08T08:30:00.000Z"));
  const PanelId split = cell.new_panel();
  VENEER_ASSERT_OK(cell.panels().retire(split, "split in two", kNow, "user anna"));
  VENEER_ASSERT_OK(cell.panels().restore(split, "glued", kLater));
  const PanelId sawn = cell.new_panel();
  VENEER_ASSERT_OK(cell.ledger().write_off(sawn, Region<PanelFrame>(square(60, 50, 20)), "burnt pattern", kNow));
  VENEER_ASSERT_OK(cell.panels().split(sawn, "local:1000", "sawn apart", kLater));
  PanelRecord part = sheet(must(cell.panels().next_panel_id()));
  part.parent = sawn;
  const Isometry2<PanelFrame, PanelFrame> part_from_parent(degrees(3), point<PanelFrame>(-20, 4));
  VENEER_ASSERT_OK(cell.panels().add_part(part, {}, {}, {part_from_parent, 3, 0.02_mm}));
  Differences differences(cell.database());
  DifferenceRecord gone, there;
  gone.gone = true, gone.place = point<PanelFrame>(352, 12), gone.area = SquareMillimetres(9.5);
  gone.shape = rectangle(350, 10, 4, 3);
  there.place = point<PanelFrame>(25, 45), there.area = SquareMillimetres(196);
  there.shape = rectangle(20, 40, 14, 14);
  there.pieces_json = R"([{"job":1,"mark":"A1-1","state":"cut"}])";
  VENEER_ASSERT_OK(differences.found(oak, {gone, there}, kNow));
  VENEER_ASSERT_OK(differences.decide(oak, {1}, DifferenceVerdict::kAccepted, "local:1000", "a chip", kLater));
  Masks masks(cell.database());
  const MaskRecord painted{
      0, "maps/3.png", "maps/3-painted.png", "0123", kLater, SquareMillimetres(5000), "maps/3-mask.png"};
  for (const bool give : {true, false})
    must(masks.add(split, {{}, give, rectangle(30, 20, 5, 5), "local:1000", "seen by eye", kLater, {}}, painted,
                   give ? 1 : 2));
  VENEER_ASSERT_OK(masks.remove(split, {2}, "local:1000", kLater, painted, 3));
  Proposals proposals(cell.database());
  ProposalRecord proposal;
  proposal.who = "local:1000", proposal.made_at = kNow, proposal.map_file = "proposals/map.png";
  proposal.mask_file = "proposals/mask.png", proposal.read_file = "proposals/read.json";
  proposal.read_sha256 = std::string(64, 'a'), proposal.scan_files = {"scans/9.png"}, proposal.tags = {301, 302};
  proposal.width = 240_mm, proposal.height = 160_mm, proposal.usable = SquareMillimetres(20'000.25);
  proposal.warnings_json = R"([{"name":"size","text":"not round"}])";
  proposal.asked = {{1, square(20, 20, 60), 0.25, false, "it looks like the board"}};
  must(proposals.add(proposal));
  proposal.asked.clear();
  VENEER_ASSERT_OK(proposals.refuse(must(proposals.add(proposal)), "local:1000", "dust", kLater));
  must(proposals.add(proposal));
  proposal.panel = split, proposal.after = 4, proposal.lost = SquareMillimetres(900);
  must(proposals.add(proposal));
  const PanelId twice = cell.new_panel(), once = cell.new_panel();
  VENEER_ASSERT_OK(cell.ledger().write_off(twice, Region<PanelFrame>(square(60, 50, 20)), "burnt pattern", kNow));
  const Isometry2<PanelFrame, PanelFrame> once_from_twice(degrees(1), point<PanelFrame>(2, 1));
  VENEER_ASSERT_OK(cell.panels().merge({once, twice, once_from_twice, 4, 0.01_mm, "local:1000", kLater}, {}, {}));
  VENEER_ASSERT_OK(cell.panels().note_restoration(kNow, "uid 1000", kNow));
  Accounts accounts(cell.database());
  VENEER_ASSERT_OK(accounts.add(UserRecord{"anna", "operator", "$argon2id$v=19$x", kNow, kNow}));
  VENEER_ASSERT_OK(
      accounts.add(CredentialRecord{std::string(64, 'a'), "token", "anna", "press room", "viewer", kNow, kLater}));
  VENEER_ASSERT_OK(accounts.add(
      CredentialRecord{std::string(64, 'b'), "session", {}, "console link 1 of uid 1000", "operator", kNow, kLater}));
  RequestKeys keys(cell.database());
  must(keys.begin({"local:1000", "newJob", "k-1", "hash"}, kNow));
  Audit audit(cell.database());
  for (const char* what : {"scan.new", "job.new", "job.start"})
    VENEER_ASSERT_OK(audit.append({0, kNow, "local:1000", what, "by hand"}));
}

}  // namespace veneer::db
