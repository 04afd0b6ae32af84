// What takes a scan back, and a panel out of stock, through the API; what is printed for panels, and noted of them.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>

#include "calib/tag_detector.h"
#include "cli/render.h"
#include "daemon/orders/packed_lattice.h"
#include "planner/pictures/pictures.h"
#include "tests/daemon/routes/panel_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class PanelRoutes : public PanelCell {};

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
  change([](Repositories& r) {
    return r.materials.add_zones({"P-0002"}, {{1, Region<PanelFrame>(strip(0, 10)), "walnut"},
                                              {2, Region<PanelFrame>(strip(10, 20)), ""},
                                              {3, Region<PanelFrame>(strip(20, 30)), "maple"}});
  });
  const json listed = get("/panels")["panels"];
  EXPECT_EQ(listed[0]["shelf"], nullptr);
  EXPECT_EQ(listed[0]["woods"], json::array());
  EXPECT_EQ(listed[1]["shelf"], "A3") << "what the console's search looks at";
  EXPECT_EQ(listed[1]["woods"], (json{"walnut", "maple"}));
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

// As the newest scan of its face knows that shows it; nobody knows of a panel's first scan. One that was taken off
// since lies too far off no more.
TEST_F(PanelRoutes, EachTagAndHoleSaysHowFarItLies) {
  db::PanelRecord panel;
  panel.id = {"P-0003"}, panel.name = "P-0003", panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
  const auto picture =
      cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "tagged");
  ASSERT_TRUE(picture.ok());
  panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256, panel.usable = kWhole;
  const auto square = [](double x) {
    return std::vector{point<PanelFrame>(x, 1), point<PanelFrame>(x + 2, 1), point<PanelFrame>(x + 2, 3),
                       point<PanelFrame>(x, 3)};
  };
  const std::vector<db::FiducialRecord> fiducials = {
      {db::FiducialKind::kTag, 7, Face::kShow, square(1)},
      {db::FiducialKind::kTag, 8, Face::kShow, square(9)},
      {db::FiducialKind::kTag, 9, Face::kBack, square(20)},
      {db::FiducialKind::kTag, 10, Face::kBack, square(26)},
      {db::FiducialKind::kHole, 0, Face::kShow, {point<PanelFrame>(15, 15)}}};
  using Offsets = std::vector<calib::FiducialOffset>;
  // All tiles of one scanning tell the same figures.
  const auto scan = [&](Face face, int scanning, const Offsets& offsets) {
    json lattice = {{"origin_px", {0, 0}}, {"step_px", 64}, {"cols", 1}, {"rows", 1}, {"panel_mm", {{1.0, 2.0}}}};
    if (!offsets.empty()) lattice["fiducials"] = lattice_fiducials(offsets);
    db::ScanRecord out;
    out.panel = panel.id, out.face = face, out.device = "twin", out.file = "f", out.sha256 = "s", out.dpi = 300;
    if (scanning > 0) out.rms = Millimetres(0.01 + 0.001 * scanning), out.max = Millimetres(0.04);
    out.lattice = packed_lattice(lattice.dump()), out.taken_at = kThen;
    return out;
  };
  const auto tag = [](int id, double off) { return calib::FiducialOffset{id, {}, Millimetres(off)}; };
  const calib::FiducialOffset hole{-1, point<PanelFrame>(15, 15), Millimetres(0.02)};
  const std::vector<db::ScanRecord> scans = {scan(Face::kShow, 0, {}),
                                             scan(Face::kShow, 1, {tag(7, 0.01), tag(8, 0.02), hole}),
                                             scan(Face::kShow, 2, {tag(7, 0.3)}),
                                             scan(Face::kShow, 2, {}),
                                             scan(Face::kBack, 3, {tag(9, 0.3)}),
                                             scan(Face::kBack, 4, {tag(9, 0.04), tag(7, 0.04)})};
  change([&](Repositories& r) { return r.panels.add(panel, scans, fiducials); });

  const json told = get("/panels/P-0003/registration")["scans"];
  ASSERT_EQ(told.size(), 6U);
  EXPECT_EQ(told[0]["fiducials"], nullptr) << "nothing to hold it against";
  EXPECT_FALSE(told[1]["lattice"].contains("fiducials"));
  ASSERT_EQ(told[1]["fiducials"].size(), 3U);
  EXPECT_EQ(
      told[1]["fiducials"][2],
      (json{
          {"kind", "hole"}, {"tag_id", nullptr}, {"place_mm", {15.0, 15.0}}, {"off_mm", 0.02}, {"over_limit", false}}));
  // How far each of them lies, as which scan tells, and whether it is too far.
  const auto offsets = [&] {
    std::vector<json> out;
    const json panel_now = get("/panels/P-0003");
    for (const json& one : panel_now["fiducials"]) out.push_back({one["off_mm"], one["off_scan"], one["over_limit"]});
    return out;
  };
  const auto row = [&](double off, int which, bool over) { return json{off, told[which]["id"], over}; };
  EXPECT_THAT(offsets(), ElementsAre(row(0.3, 2, true), row(0.02, 1, false), row(0.02, 1, false), row(0.04, 5, false),
                                     json{nullptr, nullptr, false}));
  const auto again = [&](const std::vector<db::ScanRecord>& tiles) {
    change([&](Repositories& r) { return r.panels.add_scans(panel.id, tiles, {}); });
  };
  again({scan(Face::kShow, 5, {})});
  EXPECT_EQ(offsets().front(), row(0.3, 2, true)) << "a scanning that knows of none says nothing about it";
  again({scan(Face::kShow, 6, {tag(8, 0.02)}), scan(Face::kShow, 6, {hole})});
  EXPECT_EQ(offsets().front(), row(0.3, 2, false))
      << "it was taken off: the newest scanning of its face has it nowhere";
  again({scan(Face::kShow, 7, {tag(7, 0.3)}), scan(Face::kShow, 7, {tag(8, 0.02), hole})});
  EXPECT_EQ(offsets().front()[2], true) << "on the first tile of two";
  EXPECT_THAT(cli::render_registration(get("/panels/P-0003/registration")), HasSubstr("tag 7 0.300 mm (over 0.05 mm)"));
}

// As of an import, or of a fault in what wrote it.
TEST_F(PanelRoutes, ALatticeThatCannotBeReadLeavesTheOthersReadable) {
  db::PanelRecord panel;
  panel.id = {"P-0003"}, panel.name = "P-0003", panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
  const auto picture =
      cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "torn");
  ASSERT_TRUE(picture.ok());
  panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256, panel.usable = kWhole;
  const auto scan = [&](const char* lattice) {
    db::ScanRecord out;
    out.panel = panel.id, out.face = Face::kShow, out.device = "twin", out.file = "f", out.sha256 = "s", out.dpi = 300;
    out.lattice = lattice, out.taken_at = kThen;
    return out;
  };
  change([&](Repositories& r) { return r.panels.add(panel, {scan("#64,1,1;x"), scan("#64,1,1;??")}, {}); });
  const json told = get("/panels/P-0003/registration")["scans"];
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0]["lattice"], nullptr);
  EXPECT_EQ(told[1]["lattice"]["cols"], 1);
}

std::vector<std::string> each(const json& list, const char* member) {
  std::vector<std::string> out;
  for (const json& one : list) out.push_back(one[member]);
  return out;
}

// By its place a row that came before the page's end was shown twice, and one that went let another be skipped.
TEST_F(PanelRoutes, WhatComesOrGoesBetweenTwoPagesNeitherDoublesNorHidesAnother) {
  for (const char* wood : {"ash", "maple", "oak"})
    ASSERT_EQ(post(std::string("/materials/") + wood, {{"supplier", "Miller"}}).status, 200);
  const json woods = get("/materials?limit=2");
  ASSERT_EQ(post("/materials/birch", {{"supplier", "Miller"}}).status, 200);
  EXPECT_THAT(each(get("/materials?cursor=" + woods["next"].get<std::string>())["materials"], "material"),
              ElementsAre("oak"));

  // As the list is sorted: "ash bark" comes behind both of "ash".
  for (const char* recipe : {"ash/cut", "ash/engrave", "ash%20bark/cut", "oak/cut"})
    ASSERT_EQ(post(std::string("/recipes/") + recipe, {{"speed_mm_s", 9}, {"power", 0.8}}).status, 200) << recipe;
  const json recipes = get("/recipes?limit=2");
  EXPECT_EQ(recipes["next"], "ash/engrave");
  ASSERT_EQ(ask("DELETE", "/api/v1/recipes/ash/cut").status, 200);
  EXPECT_THAT(each(get("/recipes?cursor=ash/engrave")["recipes"], "material"), ElementsAre("ash bark", "oak"));

  const std::filesystem::path backups = config.store.data_dir / "backups";
  const auto made = [](int second) { return fmt::format("2026-05-01T07-30-0{}.000Z", second); };
  for (int second : {0, 1, 2}) std::filesystem::create_directories(backups / made(second));
  const json newest = get("/backups?limit=2");
  EXPECT_THAT(each(newest["backups"], "name"), ElementsAre(made(2), made(1)));
  std::filesystem::create_directories(backups / made(3));
  EXPECT_THAT(each(get("/backups?cursor=" + newest["next"].get<std::string>())["backups"], "name"),
              ElementsAre(made(0)));
}

// Only planning told it: nobody saw after a restore which panels have to go on the scanner first.
TEST_F(PanelRoutes, ShortListsComeInPagesToo) {
  for (const char* wood : {"ash", "maple", "oak"})
    ASSERT_EQ(post(std::string("/materials/") + wood, {{"supplier", "Miller"}}).status, 200);
  const json first = get("/materials?limit=2"), last = get("/materials?limit=2&cursor=maple");
  EXPECT_EQ(first["materials"].size(), 2U);
  EXPECT_EQ(first["next"], "maple");
  EXPECT_EQ(last["materials"].size(), 1U);
  EXPECT_EQ(last["materials"][0]["material"], "oak");
  EXPECT_TRUE(last["next"].is_null());
  EXPECT_EQ(get("/materials?cursor=walnut")["materials"], json::array());
  const json newest = get("/panels/P-0001/masks?limit=1");
  EXPECT_EQ(newest["versions"][0]["version"], 2);
  EXPECT_EQ(newest["next"], 2);
  const json older = get("/panels/P-0001/masks?limit=1&cursor=2");
  EXPECT_EQ(older["versions"][0]["version"], 1);
  EXPECT_TRUE(older["next"].is_null());
  for (const char* list : {"/tasks", "/backups", "/recipes"}) {
    EXPECT_TRUE(get(list)["next"].is_null()) << list;
    EXPECT_EQ(ask("GET", std::string("/api/v1") + list + "?limit=0").status, 400) << list;
  }
}

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

}  // namespace
}  // namespace veneer::daemon
