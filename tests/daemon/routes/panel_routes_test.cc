// What takes a scan back, and a panel out of stock, through the API.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <future>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"
#include "calib/tag_detector.h"
#include "cli/render.h"
#include "planner/pictures/pictures.h"
#include "tests/support/panel_shapes.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::panel_square;
using ::testing::StartsWith;

constexpr const char* kThen = "2026-05-01T07:30:00.000Z";
constexpr int kColumns = 360, kRows = 240;
const SquareMillimetres kWhole(kColumns* kRows / (kMapResolution.px_per_mm * kMapResolution.px_per_mm));

// A zone of a panel 20 mm high.
Ring<PanelFrame> strip(double left_mm, double right_mm) {
  return {point<PanelFrame>(left_mm, 0), point<PanelFrame>(right_mm, 0), point<PanelFrame>(right_mm, 21),
          point<PanelFrame>(left_mm, 21)};
}

class PanelRoutes : public testing::RoutedCell {
 protected:
  PanelRoutes() {
    for (const char* id : {"P-0001", "P-0002"}) {
      db::PanelRecord panel;
      panel.id = {id}, panel.name = id, panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
      const auto picture =
          cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "all");
      if (!picture) throw std::runtime_error(picture.error().message);
      panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256;
      panel.usable = kWhole;
      change([&](Repositories& r) { return r.panels.add(panel, {}, {}); });
    }
    // A second scan of the first one sees half of its wood only.
    const auto less =
        cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(0)), "panels", "less");
    if (!less) throw std::runtime_error(less.error().message);
    change([&](Repositories& r) -> Status {
      const auto version =
          r.panels.add_mask({"P-0001"}, {0, less->file, less->file, less->sha256, kThen, SquareMillimetres(100)}, 1);
      return version ? Ok() : Status(version.error());
    });
  }

  template <class F>
  void change(F work) {
    const Status done = cell->database->call([&](Repositories& r) -> Status { return work(r); });
    if (!done) throw std::runtime_error(done.error().message);
  }
  json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
  // The cell books what it finds at its start, behind all else: a test of what is booked begins after that.
  void until_what_is_left_is_booked(const std::string& panel) {
    for (json it = get("/panels/" + panel); it["remnant"]["booked"].is_null(); it = get("/panels/" + panel))
      if (!it["remnant"].is_object()) throw std::runtime_error("nothing is known of what is left: " + it.dump());
  }
  ApiReply post(const std::string& path, const json& body = json::object()) {
    return ask("POST", "/api/v1" + path, body);
  }
};

// New tags begin above the AprilGrid's and above what any panel ever carried, a retired one too.
TEST_F(PanelRoutes, PrintTagsThatNoPanelHas) {
  const auto lowest = [&](const std::string& more = "") {
    const ApiReply png = ask("GET", "/api/v1/fiducials/panel?width_mm=200&height_mm=160&format=png" + more);
    EXPECT_EQ(png.status, 200) << png.body;
    const auto tags = calib::detect_tags<ScanFrame>(*planner::decode_picture(png.body, "tags"));
    return tags.empty() ? -1 : tags.front().id;
  };
  EXPECT_EQ(lowest(), 120);
  db::PanelRecord old;
  old.id = {"P-0007"}, old.name = "P-0007", old.width = 30_mm, old.height = 20_mm, old.created_at = kThen;
  const auto picture =
      cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "old");
  ASSERT_TRUE(picture.ok());
  old.map_file = old.mask_file = picture->file, old.map_hash = picture->sha256, old.usable = kWhole;
  db::FiducialRecord tag;
  tag.tag_id = 171,
  tag.corners = {point<PanelFrame>(1, 1), point<PanelFrame>(5, 1), point<PanelFrame>(5, 5), point<PanelFrame>(1, 5)};
  change([&](Repositories& r) { return r.panels.add(old, {}, {tag}); });
  EXPECT_EQ(post("/panels/P-0007/retire", {{"reason", "worn"}}).status, 200);
  EXPECT_EQ(lowest(), 172);
  EXPECT_EQ(lowest("&first_tag=300"), 300);
  const ApiReply three = ask("GET", "/api/v1/fiducials/panel?width_mm=200&height_mm=160&panels=3");
  EXPECT_THAT(three.body, StartsWith("%PDF-"));
  const ApiReply refused = ask("GET", "/api/v1/fiducials/panel?width_mm=200&height_mm=160&panels=3&format=svg");
  EXPECT_EQ(refused.status, 400);
  EXPECT_THAT(refused.body, HasSubstr("print them as PDF"));
  EXPECT_EQ(ask("GET", "/api/v1/fiducials/grid").content_type, "application/pdf");
}

TEST_F(PanelRoutes, TakeTheLastScanBack) {
  EXPECT_EQ(get("/panels/P-0001")["usable_mm2"], 100);
  const ApiReply reverted = post("/panels/P-0001/revert");
  ASSERT_EQ(reverted.status, 200) << reverted.body;
  EXPECT_EQ(body_of(reverted)["version"], 3);
  EXPECT_NEAR(get("/panels/P-0001")["usable_mm2"].get<double>(), kWhole.count(), 1e-5);
  const json masks = get("/panels/P-0001/masks");
  ASSERT_EQ(masks["versions"].size(), 3U);
  EXPECT_EQ(masks["versions"][0]["same_as"], 1);
  EXPECT_TRUE(masks["versions"][1]["same_as"].is_null());
  EXPECT_THAT(cli::render_masks(masks), HasSubstr("counts, version 1 again"));

  EXPECT_EQ(post("/panels/P-0001/revert").status, 409) << "not forth again";
  ASSERT_EQ(post("/panels/P-0001/revert", {{"version", 2}}).status, 200) << "and back";
  EXPECT_EQ(get("/panels/P-0001")["usable_mm2"], 100);
  EXPECT_EQ(post("/panels/P-0001/revert", {{"version", 9}}).status, 404);
  EXPECT_EQ(post("/panels/P-0009/revert").status, 404);
  const ApiReply once = post("/panels/P-0002/revert");
  EXPECT_EQ(once.status, 409);
  EXPECT_THAT(once.body, HasSubstr("nothing to go back to"));
}

TEST_F(PanelRoutes, ARetiredPanelIsOutOfStockUntilItIsRestored) {
  ASSERT_EQ(post("/panels/P-0002/retire", {{"reason", "the wrong face was scanned"}}).status, 200);
  EXPECT_EQ(get("/panels/P-0002")["retired"]["reason"], "the wrong face was scanned");
  const json all = get("/panels");
  EXPECT_TRUE(all["panels"][0]["retired"].is_null());
  EXPECT_THAT(cli::render_panels(all), HasSubstr("P-0002 is retired: the wrong face was scanned"));
  EXPECT_EQ(post("/panels/P-0002/retire", {{"reason", "again"}}).status, 409);
  EXPECT_EQ(post("/panels/P-0001/retire").status, 400) << "without a reason";
  EXPECT_EQ(post("/panels/P-0001/retire", {{"reason", std::string(501, 'x')}}).status, 400);
  std::string umlauts;
  for (int i = 0; i < 500; ++i) umlauts += "\xC3\xBC";
  EXPECT_EQ(post("/panels/P-0001/retire", {{"reason", umlauts}}).status, 200) << "characters, not bytes";
  ASSERT_EQ(post("/panels/P-0001/restore").status, 200);
  ASSERT_EQ(post("/panels/P-0002/restore").status, 200);
  EXPECT_THAT(cli::render_panels(get("/panels")), Not(HasSubstr("retired")));
}

TEST_F(PanelRoutes, APanelThatWasSawnApartTellsOfItsParts) {
  EXPECT_EQ(post("/panels/P-0009/split").status, 404);
  EXPECT_EQ(post("/panels/P-0002/split", {{"reason", ""}}).status, 400);
  const ApiReply split = post("/panels/P-0002/split");
  ASSERT_EQ(split.status, 200) << split.body;
  EXPECT_THAT(cli::render_retired(body_of(split)), HasSubstr("Scan each of its parts"));
  EXPECT_EQ(post("/panels/P-0002/split").status, 409);
  const json parent = get("/panels/P-0002");
  EXPECT_EQ(parent["retired"]["reason"], "sawn apart");
  EXPECT_EQ(parent["retired"]["sawn"], true);
  EXPECT_TRUE(parent["part"].is_null());
  EXPECT_TRUE(parent["parts"].empty());

  change([&](Repositories& r) -> Status {
    auto part = r.panels.find({"P-0002"});
    if (!part) return part.error();
    part->id = {"P-0003"}, part->parent = PanelId{"P-0002"};
    return r.panels.add_part(*part, {}, {}, {Isometry2<PanelFrame, PanelFrame>(Radians(0.5), {}), 4, 0.02_mm});
  });
  EXPECT_EQ(get("/panels/P-0002")["parts"], json{"P-0003"});
  const json part = get("/panels/P-0003");
  EXPECT_EQ(part["parent"], "P-0002");
  EXPECT_EQ(part["root"], "P-0002");
  EXPECT_EQ(part["part"]["fiducials"], 4);
  EXPECT_EQ(part["part"]["angle_rad"], 0.5);
  EXPECT_THAT(cli::render_panel(get("/panels/P-0002")), HasSubstr("P-0003"));
  const ApiReply back = post("/panels/P-0002/restore");
  EXPECT_EQ(back.status, 409);
  EXPECT_THAT(back.body, HasSubstr("its wood is that of its parts"));
}

// What people note is kept change by change, and nothing is planned from a surface that nobody has scanned.
TEST_F(PanelRoutes, WhatIsKnownOfWoodsAndPanelsIsNotedAndShown) {
  EXPECT_EQ(ask("GET", "/api/v1/materials/walnut").status, 404);
  const ApiReply walnut = post("/materials/walnut", {{"botanical_name", "Juglans regia"}, {"cites", "not_listed"}});
  ASSERT_EQ(walnut.status, 200) << walnut.body;
  EXPECT_EQ(post("/materials/walnut", {{"cites", "IV"}}).status, 400);
  ASSERT_EQ(post("/materials/walnut", {{"origin", "France"}, {"cites", ""}}).status, 200);
  const json known = get("/materials/walnut");
  EXPECT_EQ(known["botanical_name"], "Juglans regia");
  EXPECT_EQ(known["origin"], "France");
  EXPECT_TRUE(known["cites"].is_null());
  EXPECT_EQ(known["who"], "uid 1000");
  EXPECT_EQ(known["changes"].size(), 2U);
  EXPECT_EQ(get("/materials")["materials"].size(), 1U);

  ASSERT_EQ(post("/panels/P-0002/facts", {{"shelf", "A3"}, {"veneer_mm", 0.6}}).status, 200);
  EXPECT_EQ(post("/panels/P-0002/facts", {{"veneer_mm", 0}}).status, 400);
  EXPECT_EQ(post("/panels/P-0002/facts", {{"day", "2026-05-01"}}).status, 400) << "of what?";
  EXPECT_EQ(post("/panels/P-0002/facts", {{"sanded", "grit 240"}, {"day", "2999-01-01"}}).status, 400);
  EXPECT_EQ(post("/panels/P-0009/facts", {{"shelf", "A3"}}).status, 404);
  EXPECT_EQ(get("/panels/P-0002")["facts"]["shelf"], "A3");
  EXPECT_FALSE(get("/panels/P-0002").contains("scan_again"));

  ASSERT_EQ(post("/panels/P-0002/facts", {{"sanded", "grit 240"}, {"day", "2026-05-02"}}).status, 200);
  const json panel = get("/panels/P-0002");
  EXPECT_EQ(panel["treatments"][0]["product"], "grit 240");
  EXPECT_EQ(panel["facts"]["veneer_mm"], 0.6) << "stays as it was";
  const std::string why =
      "panel P-0002 was sanded on 2026-05-02, after the scan of 2026-05-01 that counts: scan it again";
  EXPECT_EQ(panel["scan_again"], why);
  EXPECT_THAT(cli::render_panel(panel), HasSubstr(why));
}

// Only planning told it: nobody saw after a restore which panels have to go on the scanner first.
TEST_F(PanelRoutes, PanelsThatWaitForAScanAreNamedInListAndStatus) {
  EXPECT_EQ(get("/status")["panels_to_scan"], (json{{"count", 0}, {"panels", json::array()}}));
  EXPECT_TRUE(get("/status")["next"].is_null());
  ASSERT_EQ(post("/panels/P-0002/facts", {{"sanded", "grit 240"}, {"day", "2026-05-02"}}).status, 200);
  reactor.restart();
  while (cell->counts.panels_to_scan.empty() && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  json status = get("/status");
  EXPECT_EQ(status["panels_to_scan"], (json{{"count", 1}, {"panels", {"P-0002"}}}));
  EXPECT_EQ(status["next"], "panel P-0002 waits for a scan: lay it on the scanner (veneerctl panel scan)");
  const json list = get("/panels");
  EXPECT_FALSE(list["panels"][0].contains("scan_again"));
  EXPECT_EQ(list["panels"][1]["scan_again"], get("/panels/P-0002")["scan_again"]);

  change([](Repositories& r) { return r.panels.note_restoration("2026-05-03T00:00:00.000Z", "uid 1000", kThen); });
  cell->refresh_counts();
  reactor.restart();
  while (cell->counts.panels_to_scan.size() < 2 && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  status = get("/status");
  EXPECT_THAT(cli::render_status(status), HasSubstr("2 panels, of which 2 wait for a scan: P-0001, P-0002\n"));
  EXPECT_THAT(cli::render_status(status), HasSubstr("panels P-0001 and P-0002 wait for a scan: lay each on the"));
  EXPECT_THAT(cli::render_panels(get("/panels")),
              HasSubstr("Waits for a scan: the backup of 2026-05-03 was put back on 2026-05-01, and panel P-0001 was"));

  ASSERT_EQ(post("/panels/P-0001/retire", {{"reason", "sold"}}).status, 200);
  reactor.restart();
  while (cell->counts.panels_to_scan.size() > 1 && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  EXPECT_EQ(get("/status")["panels_to_scan"]["panels"], json{"P-0002"}) << "what is out of stock waits for nothing";
}

// The area book says the same at each step, and its classes are the panel.
void expect_book(const json& panel, double reserved, double cut, double kerf) {
  const json& book = panel["area_book_mm2"];
  EXPECT_NEAR(book["panel"].get<double>(), 600, 1e-9);
  EXPECT_NEAR(book["reserved"].get<double>(), reserved, 1e-9);
  EXPECT_NEAR(book["cut"].get<double>(), cut, 1e-9);
  EXPECT_NEAR(book["kerf"].get<double>(), kerf, 1e-9);
  double sum = 0;
  for (const auto& [name, area] : book.items()) sum += name == "panel" ? 0 : area.get<double>();
  EXPECT_NEAR(sum, 600, 6e-4);
  const double beside = kWhole.count() - 600;  // these masks are a little larger than their panels
  EXPECT_GE(book["free"].get<double>() + beside, panel["free_mm2"].get<double>() - 1e-9) << "parts of pixels";
}

// It rose while pieces were cut, and counted what was cut until the next scan.
TEST_F(PanelRoutes, FreeWoodIsWhatNothingIsBookedOn) {
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], get("/panels/P-0002")["usable_mm2"]);
  db::NewPlan plan;
  plan.name = "portrait", plan.who = "local:1000", plan.plan_json = "{}", plan.options_json = "{}";
  for (const double x : {5.0, 15.0}) {
    db::PlannedPatch& patch = plan.pieces.emplace_back();
    patch.mark = x < 10 ? "A1" : "A2";
    for (const auto& p : panel_square(0, 0, 6))
      patch.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
    patch.panel = PanelId{"P-0002"};
    patch.panel_outline = panel_square(x, 5, 6);
    patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
    patch.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x, 5));
  }
  plan.planned_on = {{PanelId{"P-0002"}, 1}};
  std::vector<db::PieceRecord> pieces;
  change([&](Repositories& r) -> Status {
    const auto job = r.jobs.create(plan, kThen);
    if (!job) return job.error();
    auto all = r.jobs.pieces(*job);
    if (!all) return all.error();
    pieces = std::move(*all);
    return Ok();
  });
  // A pixel that is touched is not free, all around: 0.085 mm of 6.5 each.
  expect_book(get("/panels/P-0002"), 2 * 6.5 * 6.5, 0, 0);
  const double reserved = get("/panels/P-0002")["free_mm2"];
  EXPECT_NEAR(reserved, kWhole.count() - 2 * 6.5 * 6.5, 2 * 4 * 6.7 * 0.17);
  EXPECT_LE(reserved, kWhole.count() - 2 * 6.5 * 6.5);
  change([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(
        pieces[0].job, PanelId{"P-0002"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, kThen);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting(pieces[0].id, kThen); !cutting) return cutting;
    if (Status cut = r.jobs.book_piece(pieces[0].id, kThen); !cut) return cut;
    return r.jobs.finish_run(*run, false, kThen);
  });
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], reserved) << "what was cut is as little free as what is to be cut";
  expect_book(get("/panels/P-0002"), 6.5 * 6.5, 36, 6.5 * 6.5 - 36);
  change([&](Repositories& r) { return r.jobs.cancel(pieces[0].job, kThen); });
  expect_book(get("/panels/P-0002"), 0, 36, 6.5 * 6.5 - 36);
  EXPECT_NEAR(get("/panels/P-0002")["free_mm2"].get<double>(), (kWhole.count() + reserved) / 2, 1e-6);
}

TEST_F(PanelRoutes, WhatAScanAndTheLedgerDisagreeAboutStaysUntilSomebodyDecides) {
  db::DifferenceRecord hole;
  hole.gone = true;
  hole.place = point<PanelFrame>(11, 6), hole.area = SquareMillimetres(12);
  hole.shape = Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(10, 5), point<PanelFrame>(14, 5),
                                                   point<PanelFrame>(14, 8), point<PanelFrame>(10, 8)});
  change([&](Repositories& r) { return r.differences.found({"P-0002"}, {hole}, kThen); });
  EXPECT_EQ(get("/panels/P-0002")["open_differences"], 1);
  EXPECT_THAT(cli::render_panels(get("/panels")),
              HasSubstr("P-0002: wood and ledger disagree in 1 place: `veneerctl panel differences P-0002`\n"));
  EXPECT_THAT(cli::render_differences(get("/panels/P-0002/differences")),
              HasSubstr("   1  wood is gone that is not booked as cut, at 11.0, 6.0 mm, 12.0 mm2\n"));
  EXPECT_EQ(post("/panels/P-0002/differences/1/decide", {{"verdict", "whatever"}}).status, 400);
  EXPECT_EQ(
      post("/panels/P-0002/differences/1/decide", {{"verdict", "accepted"}, {"note", std::string(501, 'x')}}).status,
      400);
  EXPECT_EQ(post("/panels/P-0002/differences/7/decide", {{"verdict", "accepted"}}).status, 404);
  EXPECT_EQ(post("/panels/P-0001/differences/1/decide", {{"verdict", "accepted"}}).status, 404) << "another panel's";
  const ApiReply decided =
      post("/panels/P-0002/differences/1/decide", {{"verdict", "written_off"}, {"note", "a knot"}});
  ASSERT_EQ(decided.status, 200) << decided.body;
  EXPECT_THAT(cli::render_differences(body_of(decided)), HasSubstr("written off, uid 1000, a knot\nNothing is open"));
  EXPECT_EQ(get("/panels/P-0002")["open_differences"], 0);
  EXPECT_NEAR(get("/panels/P-0002")["area_book_mm2"]["scrap"].get<double>(), 12, 1e-9);
  EXPECT_EQ(post("/panels/P-0002/differences/1/decide", {{"verdict", "accepted"}}).status, 409);
}

TEST_F(PanelRoutes, WhatAScanAndTheLedgerDisagreeAboutComesInPages) {
  std::vector<db::DifferenceRecord> holes;
  for (const double x : {1.0, 6.0, 11.0, 16.0, 21.0}) {
    db::DifferenceRecord& hole = holes.emplace_back();
    hole.gone = true;
    hole.place = point<PanelFrame>(x + 1, 2), hole.area = SquareMillimetres(4);
    hole.shape = Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, 1), point<PanelFrame>(x + 2, 1),
                                                     point<PanelFrame>(x + 2, 3), point<PanelFrame>(x, 3)});
  }
  change([&](Repositories& r) { return r.differences.found({"P-0002"}, holes, kThen); });
  std::vector<int> seen;
  json cursor = 0;
  for (int pages = 0; !cursor.is_null() && pages < 10; ++pages) {
    const json page = get("/panels/P-0002/differences?limit=2&cursor=" + cursor.dump());
    EXPECT_LE(page["differences"].size(), 2U);
    for (const json& difference : page["differences"]) seen.push_back(difference["id"]);
    cursor = page["next"];
  }
  EXPECT_EQ(seen, (std::vector<int>{5, 4, 3, 2, 1})) << "the newest first";
  EXPECT_TRUE(get("/panels/P-0002/differences?limit=5")["next"].is_null());
}

TEST_F(PanelRoutes, TellsWhatIsLeftOfAPanel) {
  until_what_is_left_is_booked("P-0002");
  change([](Repositories& r) {
    // The left third is walnut, nobody has said what the rest is of.
    return r.materials.add_zones({"P-0002"}, {{1, strip(0, 10), "walnut"}, {2, strip(10, 30), ""}});
  });
  const json fresh = get("/panels/P-0002")["remnant"];
  ASSERT_EQ(fresh["woods"].size(), 2U) << fresh.dump();
  EXPECT_TRUE(fresh["woods"][0]["material"].is_null());
  EXPECT_EQ(fresh["woods"][1]["material"], "walnut");
  EXPECT_NEAR(fresh["woods"][1]["free_mm2"].get<double>(), 200, 6);
  EXPECT_LE(fresh["woods"][1]["free_mm2"].get<double>(), 204) << "the mask is a little larger than its panel";
  EXPECT_NEAR(fresh["square"]["side_mm"].get<double>(), 20.3, 0.05);
  EXPECT_NEAR(fresh["circle"]["diameter_mm"].get<double>(), 20.3, 0.05);
  EXPECT_EQ(get("/panels/P-0002")["remnant"], fresh);

  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(12, 2, 6)), "a knot", kThen);
  });
  const json left = get("/panels/P-0002");
  // On the right of the knot, or on its left, are 12 mm.
  EXPECT_NEAR(left["remnant"]["square"]["side_mm"].get<double>(), 12.3, 0.2) << left["remnant"].dump();
  EXPECT_NEAR(left["remnant"]["circle"]["diameter_mm"].get<double>(), 14.9, 1.0) << left["remnant"].dump();
  EXPECT_NEAR(left["remnant"]["woods"][0]["free_mm2"].get<double>(), fresh["woods"][0]["free_mm2"].get<double>() - 36,
              5);
  EXPECT_EQ(left["remnant"]["woods"][1], fresh["woods"][1]);
  EXPECT_THAT(cli::render_panel(left), HasSubstr("wood nobody has named 4 cm2, walnut 2 cm2\n"));
  EXPECT_THAT(cli::render_panel(left), HasSubstr("a square of 12."));
  EXPECT_TRUE(get("/panels/P-0001")["remnant"].is_object());
}

TEST_F(PanelRoutes, TellsWhatWasBookedOfAPanel) {
  EXPECT_EQ(cli::render_remnants({{"remnants", json::array()}}), "Nothing was booked of this panel yet.\n");
  until_what_is_left_is_booked("P-0002");
  const json first = get("/panels/P-0002/remnants?limit=5")["remnants"];
  ASSERT_EQ(first.size(), 1U) << first.dump();
  EXPECT_EQ(first[0]["number"], 1);
  EXPECT_TRUE(get("/panels/P-0002")["remnant"]["booked"]["is_now"].get<bool>());
  EXPECT_EQ(ask("GET", first[0]["picture"].get<std::string>()).status, 200);
  change([](Repositories& r) {
    db::RemnantRecord remnant;
    remnant.panel = {"P-0002"}, remnant.mask_version = 1, remnant.counted_of = "other wood", remnant.at = kThen;
    remnant.woods = {{"walnut", SquareMillimetres(1250)}};
    remnant.square = db::RemnantRecord::Room{point<PanelFrame>(5, 6), 12_mm};
    return r.remnants.book(remnant);
  });
  const json booked = get("/panels/P-0002")["remnant"]["booked"];
  EXPECT_EQ(booked, (json{{"number", 2}, {"run", nullptr}, {"at", kThen}, {"is_now", false}}));
  EXPECT_THAT(cli::render_panel(get("/panels/P-0002")), HasSubstr("; its wood changed since"));
  const json all = get("/panels/P-0002/remnants?limit=5");
  ASSERT_EQ(all["remnants"].size(), 2U) << all.dump();
  EXPECT_EQ(all["remnants"][1], first[0]);
  EXPECT_EQ(all["remnants"][0]["square"], (json{{"side_mm", 12.0}, {"x_mm", 5.0}, {"y_mm", 6.0}}));
  EXPECT_TRUE(all["remnants"][0]["circle"].is_null());
  EXPECT_TRUE(all["remnants"][0]["picture"].is_null());
  EXPECT_THAT(cli::render_remnants(all), HasSubstr("walnut 12 cm2"));
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0002/remnant.png?booked=2").status, 404) << "it was not drawn";
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0002/remnant.png?booked=3").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/remnants").status, 404);
}

TEST_F(PanelRoutes, ThePictureOfARemnantIsPaleWhereNothingIsFree) {
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(2, 2, 6)), "a knot", kThen);
  });
  const ApiReply reply = ask("GET", "/api/v1/panels/P-0002/remnant.png");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const cv::Mat picture = *planner::decode_picture(reply.body, "remnant");
  ASSERT_EQ(picture.size(), cv::Size(kColumns, kRows));
  // This wood is white; what is not free is a little grey.
  const auto at = [&](double x_mm, double y_mm) {
    return picture.at<cv::Vec3b>(kRows - cvRound(y_mm * 300 / 25.4), cvRound(x_mm * 300 / 25.4));
  };
  EXPECT_EQ(at(29, 1), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(at(5, 5), cv::Vec3b(240, 240, 240));
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/remnant.png").status, 404);
}

TEST_F(PanelRoutes, ALabelIsAFileOfTheKindAskedFor) {
  const ApiReply pdf = ask("GET", "/api/v1/panels/P-0002/label");
  ASSERT_EQ(pdf.status, 200) << pdf.body;
  EXPECT_EQ(pdf.content_type, "application/pdf");
  EXPECT_TRUE(pdf.body.starts_with("%PDF-"));
  const ApiReply svg = ask("GET", "/api/v1/panels/P-0002/label?format=svg");
  EXPECT_EQ(svg.content_type, "image/svg+xml");
  EXPECT_THAT(svg.body, HasSubstr("<svg"));
  const ApiReply png = ask("GET", "/api/v1/panels/P-0002/label?format=png");
  EXPECT_EQ(png.content_type, "image/png");
  EXPECT_TRUE(planner::decode_picture(png.body, "label").ok());
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/label").status, 404);
}

TEST_F(PanelRoutes, FindsThePanelsThatHaveTheWoodOneLooksFor) {
  // P-0002 is walnut on the left and maple on the right, and looks so. P-0001 has no wood left.
  cv::Mat map(kRows, kColumns, CV_8UC3, cv::Scalar(190, 220, 240));
  map.colRange(0, kColumns / 2) = cv::Scalar(40, 60, 80);
  const auto walnut_and_maple = cell->panel_library.store_picture(map, "panels", "both");
  const auto mask =
      cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "all");
  ASSERT_TRUE(walnut_and_maple.ok() && mask.ok());
  change([&](Repositories& r) -> Status {
    const auto version = r.panels.add_mask(
        {"P-0002"}, {0, walnut_and_maple->file, mask->file, walnut_and_maple->sha256, kThen, kWhole}, 1);
    if (!version) return version.error();
    return r.materials.add_zones({"P-0002"}, {{1, strip(0, 15), "walnut"}, {2, strip(15, 31), "maple"}});
  });
  const auto found = [&](const std::string& query) {
    const json reply = get("/panels?" + query);
    std::string text;
    for (const json& panel : reply["panels"])
      text += fmt::format("{}{} {:.0f}", text.empty() ? "" : ", ", panel["id"].get<std::string>(),
                          panel["fitting_mm2"].get<double>());
    return text;
  };
  EXPECT_EQ(found("min_free_mm2=100"), "P-0002 619") << "P-0001 has none";
  EXPECT_EQ(found("min_free_mm2=700"), "");
  EXPECT_EQ(found("wood=oak"), "");
  EXPECT_EQ(found("wood=walnut&min_free_mm2=310"), "") << "it has 300";
  EXPECT_EQ(found("wood=walnut&patch_mm=16"), "") << "it is 15 mm wide";
  const std::string walnut = found("wood=walnut&patch_mm=14");
  EXPECT_THAT(walnut, HasSubstr("P-0002 30"));
  // Half of its wood each, but for what lies so near to the other half that it looks like neither.
  EXPECT_NEAR(get("/panels?tone=dark&patch_mm=14")["panels"][0].value("fitting_mm2", 0.0), 310 - 10, 15);
  EXPECT_NEAR(get("/panels?tone=light&patch_mm=14")["panels"][0].value("fitting_mm2", 0.0), 310 - 10, 15);
  EXPECT_EQ(found("tone=dark&patch_mm=16"), "");
  EXPECT_EQ(found("tone=dark&wood=maple&patch_mm=2"), "");
  // A knot in the walnut leaves strips of 4 and 5 mm on its sides, and 8 mm below and above it.
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(4, 8, 6)), "a knot", kThen);
  });
  EXPECT_EQ(found("wood=walnut&patch_mm=9"), "");
  EXPECT_THAT(found("wood=walnut&patch_mm=6"), HasSubstr("P-0002 2"));
  EXPECT_THAT(cli::render_found(get("/panels?wood=walnut&patch_mm=6")), HasSubstr("P-0002"));
  EXPECT_EQ(cli::render_found(get("/panels?wood=oak")), "No panel in stock has so much of this wood.\n");
  // Pages go on where the one before stopped.
  EXPECT_EQ(get("/panels?min_free_mm2=1&limit=1")["panels"].size(), 1U);
  EXPECT_TRUE(get("/panels?min_free_mm2=1&limit=1&cursor=2")["panels"].empty());
  ASSERT_EQ(post("/panels/P-0002/retire", {{"reason", "sold"}}).status, 200);
  EXPECT_EQ(found("min_free_mm2=1"), "") << "out of stock";
}

// Whoever asks for all panels, whose masks have to be looked at, keeps nobody from what is known.
TEST_F(PanelRoutes, AMaskIsLookedAtAmongThePicturesAndWhatIsKnownIsToldAtOnce) {
  const json known = get("/panels/P-0001");
  EXPECT_TRUE(known["area_book_mm2"].is_object()) << known;
  ApiRequest question;
  question.caller = {Role::kAdmin, "uid 1000", TransportKind::kUnix};
  std::promise<void> looking, looked;
  cell->pictures->ask(
      question, [](const ApiReply&) {},
      [&looking, seen = looked.get_future().share()](Repositories&) {
        looking.set_value();
        seen.wait();
        return ApiReply();
      });
  looking.get_future().wait();
  EXPECT_EQ(get("/panels/P-0001"), known);
  const auto answer = begin_asking("GET", "/api/v1/panels/P-0002");
  reactor.restart();
  while (!*answer && cell->pictures->waiting() == 0 && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  EXPECT_FALSE(*answer) << "it did not wait its turn";
  EXPECT_EQ(cell->pictures->waiting(), 1U);
  looked.set_value();
  while (!*answer && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  ASSERT_TRUE(*answer);
  EXPECT_TRUE(body_of(**answer)["remnant"].is_object());
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009").status, 404);
}

// One file that is lost must not hide the whole stock.
TEST_F(PanelRoutes, AMaskThatCannotBeReadLeavesNothingFreeAndTheOthersListed) {
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0001"}, Region<PanelFrame>(panel_square(5, 5, 6)), "burnt", kThen);
  });
  std::filesystem::remove(cell->panel_library.path_of(
      cell->database->call([](Repositories& r) { return r.panels.find({"P-0001"}); })->mask_file));
  const json all = get("/panels");
  ASSERT_EQ(all["panels"].size(), 2U) << all.dump();
  EXPECT_EQ(all["panels"][0]["free_mm2"], 0);
  EXPECT_GT(all["panels"][1]["free_mm2"], 0);
  EXPECT_TRUE(get("/panels/P-0001")["area_book_mm2"].is_null());
}

}  // namespace
}  // namespace veneer::daemon
