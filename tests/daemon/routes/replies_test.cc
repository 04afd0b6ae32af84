// Every question of the API is answered as docs/openapi.json says, with every key it writes described there, and
// veneerctl's tables have something in every column.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <sstream>

#include "cli/audit_log.h"
#include "cli/render.h"
#include "planner/files/plan_files.h"
#include "tests/support/json_schema.h"
#include "tests/support/routed_cell.h"
#include "tests/support/stocked_database.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* kAt = "2026-05-01T07:30:00.000Z";

class Replies : public testing::RoutedCell {
 protected:
  void SetUp() override {
    ASSERT_TRUE(tests::stock_two_panels(*cell->database, 3, 2).ok());
    const auto wood = cell->panel_library.store_picture(cv::Mat(60, 90, CV_8UC1, cv::Scalar(255)), "panels", "mask");
    ASSERT_TRUE(wood.ok());
    const Status filled =
        cell->database->call([file = wood->file, hash = wood->sha256](Repositories& r) { return fill(r, file, hash); });
    ASSERT_TRUE(filled.ok()) << filled.error().message;
    EXPECT_EQ(ask("POST", "/api/v1/recipes/walnut/cut",
                  {{"speed_mm_s", 9}, {"power", 0.8}, {"passes", 2}, {"kerf_back_mm", 0.31}})
                  .status,
              200);
    EXPECT_EQ(ask("POST", "/api/v1/users/anna", {{"role", "operator"}, {"password", "walnut and maple"}}).status, 200);
    EXPECT_EQ(ask("POST", "/api/v1/users/anna/tokens/press", {{"role", "viewer"}}).status, 200);
    cell->tasks.start("scan", "scanning").done({{"panel", "P-0003"}});
    cell->tasks.start("plan", "planning").fail({ErrorCode::kRefused, "there is no wood: scan a panel"});
    static_cast<void>(cell->tasks.start("scan", "scanning"));
    cell->refresh_counts();
    until_counted();
  }

  // One piece, which could lie elsewhere too.
  static planner::Plan drawn_plan() {
    planner::Plan plan;
    planner::Piece& piece = plan.pieces.emplace_back();
    piece.mark = "A1-1", piece.cost = 2, piece.pixels = 4;
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(9, 0), point<ArtworkFrame>(9, 9)};
    piece.placement = planner::Placement{{"P-0003"}, {Radians(0), point<PanelFrame>(20, 20)}};
    piece.alternatives = {{{{"P-0003"}, {Radians(0), point<PanelFrame>(40, 20)}}, 3}};
    plan.artworks = {{"darker", "A", 9_mm, 9_mm}};
    return plan;
  }

  // A remnant that was scanned, masks for all, an aborted run, a changed plan, a certificate of another device.
  static Status fill(Repositories& r, const std::string& file, const std::string& hash) {
    for (const char* panel : {"P-0001", "P-0002"})
      if (auto mask = r.panels.add_mask(PanelId{panel}, {0, file, file, hash, kAt}, 1); !mask) return mask.error();
    db::PanelRecord panel;
    panel.id = PanelId{"P-0003"};
    panel.name = "the large offcut";
    panel.width = 90_mm, panel.height = 60_mm;
    panel.map_file = panel.mask_file = file, panel.map_hash = hash;
    panel.created_at = kAt;
    panel.parent = panel.root = PanelId{"P-0001"};
    db::ScanRecord scan;
    scan.panel = panel.id;
    scan.device = "twin:1", scan.file = file, scan.sha256 = hash, scan.dpi = 600, scan.rms = 0.012_mm;
    scan.max = 0.04_mm, scan.taken_at = kAt;
    scan.lattice = R"({"panel_mm":[[1,2]],"fiducials":[{"tag":201,"place_mm":[0,0],"off_mm":0.3},)"
                   R"({"tag":null,"place_mm":[0,0],"off_mm":0.01}]})";
    db::FiducialRecord tag;
    tag.tag_id = 201;
    const Ring<PanelFrame> square = {point<PanelFrame>(0, 0), point<PanelFrame>(8, 0), point<PanelFrame>(8, 8),
                                     point<PanelFrame>(0, 8)};
    tag.corners = square;
    db::FiducialRecord hole = tag;
    hole.kind = db::FiducialKind::kHole, hole.tag_id = 0, hole.face = Face::kBack, hole.corners.resize(1);
    if (Status added = r.panels.add(panel, {scan}, {tag, hole}); !added) return added;
    if (Status zones = r.materials.add_zones(
            panel.id, {{1, Region<PanelFrame>(square), "walnut", 0.9}, {2, Region<PanelFrame>(square), ""}});
        !zones)
      return zones;

    for (const char* origin : {"France", "Italy"})
      if (Status set = r.facts.set_material({"walnut", "Juglans regia", origin, "Miller", "III", "uid 1000", kAt});
          !set)
        return set;
    for (const auto& shelf : {"A3", "B1"})
      if (Status set = r.facts.set_panel(panel.id, {shelf, 0.6_mm, 1.5_mm, "uid 1000", kAt},
                                         {{db::TreatmentKind::kFinish, "shellac", "2026-04-30", "", ""}});
          !set)
        return set;

    db::DifferenceRecord difference;
    difference.place = point<PanelFrame>(4, 4);
    difference.shape = Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(2, 2), point<PanelFrame>(6, 2),
                                                           point<PanelFrame>(6, 6), point<PanelFrame>(2, 6)});
    difference.pieces_json = R"([{"job":1,"mark":"A1-1","state":"cut"}])";
    db::DifferenceRecord gone = difference;
    gone.gone = true, gone.pieces_json = "[]";
    if (Status found = r.differences.found(panel.id, {difference, gone}, kAt); !found) return found;
    if (const auto decided = r.differences.decide(panel.id, {1}, db::DifferenceVerdict::kAccepted, "uid 1000", "", kAt);
        !decided)
      return decided.error();

    const auto pieces = r.jobs.pieces(JobId{1});
    if (!pieces) return pieces.error();
    const auto run = r.jobs.start_run(
        JobId{1}, PanelId{"P-0001"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(400, 300), Handedness::kImproper), 0.04_mm, kAt);
    if (!run) return run.error();
    for (const std::size_t i : {0U, 1U})
      if (Status cutting = r.jobs.mark_cutting((*pieces)[i].id, kAt); !cutting) return cutting;
    if (Status booked = r.jobs.book_piece((*pieces)[0].id, kAt); !booked) return booked;
    if (Status broken = r.jobs.abort_run(*run, {}, "the lid was opened", kAt); !broken) return broken;
    const db::RemnantRecord::Room room{point<PanelFrame>(20, 10), 21_mm};
    db::RemnantRecord remnant;
    remnant.panel = PanelId{"P-0001"}, remnant.mask_version = 2, remnant.run = *run, remnant.counted_of = "what it was";
    remnant.woods = {{"walnut", SquareMillimetres(900)}};
    remnant.square = remnant.circle = room, remnant.picture_file = file, remnant.at = kAt;
    if (Status left = r.remnants.book(remnant); !left) return left;

    db::NewPlan changed;
    changed.name = "darker", changed.parent = db::PlanId{1}, changed.who = "local:1000";
    changed.plan_json = planner::plan_to_json(drawn_plan()), changed.options_json = R"({"size_mm":60})";
    changed.report_json = R"({"cost_per_pixel":0.01,"without_lead":0,"warnings":[],"global":null,"fine":null})";
    db::PlannedPatch& patch = changed.pieces.emplace_back();
    patch.mark = "A1-1";
    patch.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(9, 0), point<ArtworkFrame>(9, 9)};
    patch.panel = PanelId{"P-0003"};
    patch.panel_outline = {point<PanelFrame>(20, 20), point<PanelFrame>(29, 20), point<PanelFrame>(29, 29)};
    patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.27_mm);
    patch.lead_in = point<PanelFrame>(19, 19);
    changed.planned_on = {{PanelId{"P-0003"}, 1}};
    const auto plan = r.plans.add(changed, kAt);
    if (!plan) return plan.error();
    if (auto leased = r.leases.take(*plan, "uid 1000", kAt, "2999-01-01T00:00:00.000Z"); !leased) return leased.error();

    db::ProposalRecord seen;
    seen.who = "uid 1000", seen.made_at = kAt, seen.map_file = seen.mask_file = seen.read_file = file;
    seen.read_sha256 = hash, seen.scan_files = {file}, seen.tags = {301}, seen.width = 240_mm, seen.height = 160_mm;
    seen.warnings_json = R"([{"name":"size","text":"the sheet is not round"}])";
    seen.asked = {{1,
                   {point<PanelFrame>(5, 5), point<PanelFrame>(15, 5), point<PanelFrame>(15, 90)},
                   0.25,
                   false,
                   "it looks like the board"}};
    for (const bool decided : {true, false}) {
      const auto proposed = r.proposals.add(seen);
      if (!proposed) return proposed.error();
      if (!decided) continue;
      if (Status refused = r.proposals.refuse(*proposed, "uid 1000", "dust", kAt); !refused) return refused;
    }
    db::MaskEdit edit;
    edit.shape = difference.shape, edit.who = "uid 1000", edit.note = "a stain", edit.at = kAt;
    if (const auto edited = r.masks.add(panel.id, edit, {0, file, file, hash, kAt}, 1); !edited) return edited.error();

    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kScanner;
    certificate.issued_at = kAt, certificate.expires_at = "2999-01-01T00:00:00.000Z";
    json payload = to_payload(calib::ScannerCertificateData{});
    payload["device"] = "twin at 300 dpi";
    certificate.payload = payload.dump();
    auto issued = r.certificates.issue(certificate);
    return issued ? Ok() : Status(issued.error());
  }

  json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
};

// Headings of columns in which no line has anything: every column is aligned with one end of its heading.
std::vector<std::string> empty_columns(const std::string& table) {
  std::istringstream text(table);
  std::string heading, line;
  std::getline(text, heading);
  std::vector<std::string> lines, empty;
  while (std::getline(text, line)) lines.push_back(line + std::string(heading.size(), ' '));
  for (std::size_t at = heading.find_first_not_of(' '); at < heading.size();) {
    const std::size_t end = std::min(heading.find("  ", at), heading.size());
    const bool filled = std::any_of(lines.begin(), lines.end(),
                                    [&](const std::string& l) { return l[at] != ' ' || l[end - 1] != ' '; });
    if (!filled) empty.push_back(heading.substr(at, end - at));
    at = std::min(heading.find_first_not_of(' ', end), heading.size());
  }
  return empty;
}

TEST_F(Replies, AreWhatTheDescriptionSays) {
  // For each question whose answer is JSON: something to ask. Nothing was put on the bed, so that has no toolpath, and
  // the cell is no simulated one.
  const std::set<std::string> refused = {"getBedToolpath", "listSheets"};
  const std::map<std::string, std::string> questions = {{"getStatus", "/status"},
                                                        {"getSession", "/session"},
                                                        {"listPanels", "/panels"},
                                                        {"getPanel", "/panels/P-0003"},
                                                        {"getPanelRegistration", "/panels/P-0003/registration"},
                                                        {"getPanelLedger", "/panels/P-0003/ledger"},
                                                        {"getPanelMapTiles", "/panels/P-0002/map-tiles"},
                                                        {"getPanelFacts", "/panels/P-0003/facts"},
                                                        {"listMaterials", "/materials"},
                                                        {"getMaterial", "/materials/walnut"},
                                                        {"getPanelMasks", "/panels/P-0001/masks"},
                                                        {"listMaskEdits", "/panels/P-0003/mask-edits"},
                                                        {"getMaskEdit", "/panels/P-0003/mask-edits/1"},
                                                        {"listProposals", "/proposals?all=true"},
                                                        {"getProposal", "/proposals/1"},
                                                        {"getPanelDifferences", "/panels/P-0003/differences"},
                                                        {"listRecipes", "/recipes"},
                                                        {"listCertificates", "/certificates"},
                                                        {"getCertificate", "/certificates/2?x=100&y=200"},
                                                        {"listPlans", "/plans?limit=1"},
                                                        {"getPlan", "/plans/1"},
                                                        {"getPlanPieces", "/plans/2/pieces"},
                                                        {"getPlanAlternatives", "/plans/2/pieces/A1-1/alternatives"},
                                                        {"getPlanFile", "/plans/1/plan.json"},
                                                        {"listJobs", "/jobs"},
                                                        {"getJob", "/jobs/1"},
                                                        {"getJobPieces", "/jobs/1/pieces"},
                                                        {"getPiece", "/pieces/1"},
                                                        {"getPieceByMark", "/jobs/1/pieces/A1-1"},
                                                        {"getPanelPlace", "/panels/P-0001/place?x=15&y=15"},
                                                        {"getJobPlan", "/jobs/1/plan.json"},
                                                        {"listBackups", "/backups"},
                                                        {"getAudit", "/audit"},
                                                        {"getHistory", "/history"},
                                                        {"getEventHistory", "/history/events"},
                                                        {"getWoodHistory", "/history/wood"},
                                                        {"listUsers", "/users"},
                                                        {"listTokens", "/tokens"},
                                                        {"listTasks", "/tasks"},
                                                        {"getTask", "/tasks/2"},
                                                        {"getBedToolpath", "/bed/toolpath"},
                                                        {"getSetup", "/setup"},
                                                        {"getDevices", "/devices"},
                                                        {"findDevices", "/devices/found"},
                                                        {"listSheets", "/sim/sheets"},
                                                        {"listAlarms", "/alarms"},
                                                        {"listPanelRemnants", "/panels/P-0001/remnants"}};
  std::ifstream file(VENEER_OPENAPI);
  const json openapi = json::parse(file, nullptr, false);
  for (const auto& [path, methods] : openapi["paths"].items()) {
    if (!methods.contains("get")) continue;
    const json& operation = methods["get"];
    const std::string id = operation["operationId"];
    const json::json_pointer good("/responses/200/content/application~1json/schema");
    if (!operation.contains(good)) continue;
    ASSERT_TRUE(questions.contains(id)) << "nothing here asks " << path;
    const ApiReply reply = ask("GET", "/api/v1" + questions.at(id));
    ASSERT_TRUE(reply.status == 200 || refused.contains(id)) << id << ": " << reply.body;
    json escaped = json::object();
    escaped[path] = 0;
    const std::string at = "/paths" + escaped.flatten().begin().key() + "/get" + good.to_string();
    EXPECT_THAT(testing::openapi_errors(body_of(reply), reply.status == 200 ? at : "/components/schemas/Error"),
                IsEmpty())
        << id << ": " << reply.body.substr(0, 2000);
  }
}

TEST_F(Replies, EveryColumnOfATableHasSomethingInIt) {
  using cli::render_pieces;
  const std::vector<std::string> tables = {cli::render_panels(get("/panels")),
                                           cli::render_found(get("/panels?min_free_mm2=1&patch_mm=2")),
                                           cli::render_jobs(get("/jobs")),
                                           cli::render_plans(get("/plans")),
                                           render_pieces(get("/jobs/1/pieces")),
                                           cli::render_ledger(get("/panels/P-0001/ledger")),
                                           cli::render_remnants(get("/panels/P-0001/remnants")),
                                           cli::render_certificates(get("/certificates")),
                                           cli::render_recipes(get("/recipes")),
                                           cli::render_audit(get("/audit")),
                                           cli::render_zones(get("/panels/P-0003")),
                                           cli::render_proposals(get("/proposals?all=true")),
                                           cli::render_edits(get("/panels/P-0003/mask-edits")),
                                           cli::render_materials(get("/materials"))};
  for (const std::string& table : tables) EXPECT_THAT(empty_columns(table), IsEmpty()) << table;
  EXPECT_THAT(render_pieces(get("/jobs/1/pieces")), HasSubstr("A1-1"));
  EXPECT_THAT(render_pieces(get("/jobs/1/pieces")), Not(HasSubstr("ROW"))) << "the mark says it";
}

TEST_F(Replies, WhatIsToldOfOneThingNamesIt) {
  for (const std::string& text :
       {cli::render_status(get("/status")), cli::render_panel(get("/panels/P-0003")), cli::render_job(get("/jobs/1")),
        cli::render_differences(get("/panels/P-0003/differences")), cli::render_plan(get("/plans/2")),
        cli::render_proposal(get("/proposals/1")), cli::render_proposals(get("/proposals")),
        cli::render_tasks(get("/tasks")), cli::render_task(get("/tasks/2")),
        cli::render_registration(get("/panels/P-0003/registration")),
        cli::render_panel_facts(get("/panels/P-0003/facts")), cli::render_material(get("/materials/walnut"))})
    EXPECT_THAT(text, Not(HasSubstr("?")));
  EXPECT_THAT(cli::render_panel(get("/panels/P-0003")), HasSubstr("the large offcut"));
  EXPECT_THAT(cli::render_panel(get("/panels/P-0003")), HasSubstr("2026-04-30, shellac"));
  EXPECT_THAT(cli::render_panel_facts(get("/panels/P-0003/facts")),
              HasSubstr("A3, 0.60 mm of veneer, 1.50 mm of substrate, noted 2026-05-01 by uid 1000"));
  EXPECT_THAT(cli::render_material(get("/materials/walnut")), HasSubstr("Juglans regia, France, appendix III, Miller"));
  EXPECT_THAT(cli::render_job(get("/jobs/1")), HasSubstr("1 of 5 pieces"));
  EXPECT_THAT(cli::render_plan(get("/plans/2")), HasSubstr("kept until 2999-01-01 00:00:00 UTC for uid 1000"));
  EXPECT_THAT(cli::render_place(get("/panels/P-0003/place?x=26&y=22")), HasSubstr("Leased to plan 2 since"));
  EXPECT_THAT(cli::render_task(get("/tasks/2")), HasSubstr("there is no wood"));
}

}  // namespace
}  // namespace veneer::daemon
