// The scan service on rendered sheets: what becomes of a panel's mask when it is scanned again.
#include "daemon/stock/scan_service.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/orders/scan_json.h"
#include "drivers/file/file_scanner.h"
#include "tests/daemon/stock/scanned_sheet.h"

namespace veneer::daemon {
namespace {

Region<PanelFrame> square(double x, double y, double side) {
  return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, y), point<PanelFrame>(x + side, y),
                                             point<PanelFrame>(x + side, y + side), point<PanelFrame>(x, y + side)});
}

// Pieces of 8 x 8 mm, one above the other, of which nobody knows whether they were cut out.
void make_suspect(DatabaseThread& database, double x) {
  db::NewPlan plan;
  plan.name = "portrait", plan.who = "local:1000", plan.plan_json = "{}", plan.options_json = "{}";
  plan.planned_on = {{PanelId{"P-0001"}, 1}};
  const Ring<PanelFrame> corners = square(0, 0, 8).rings().at(0);
  for (const double y : {30.0, 45.0, 60.0}) {
    db::PlannedPatch& patch = plan.pieces.emplace_back();
    patch.mark = fmt::format("A{:.0f}", y);
    patch.panel = PanelId{"P-0001"};
    for (const auto& p : corners) {
      patch.artwork_outline.push_back({p.x, p.y});
      patch.panel_outline.push_back({p.x + Millimetres(x), p.y + Millimetres(y)});
    }
    patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.2_mm);
    patch.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x, y));
  }
  ASSERT_TRUE(database.call([&](Repositories& r) -> Status {
    const auto job = r.jobs.create(plan, utc_timestamp());
    if (!job) return job.error();
    const auto pieces = r.jobs.pieces(*job);
    std::vector<PieceId> all;
    for (const auto& piece : *pieces) all.push_back(piece.id);
    return r.jobs.make_suspect(all, utc_timestamp());
  }));
}

class ScanServiceTest : public ScannedSheet {};

// A screw hole that a cut has opened is hard to see in the new scan; what the mask knew before must count.
TEST_F(ScanServiceTest, WoodDoesNotGrowBackWhenAPanelIsScannedAgain) {
  auto first = scan();
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_GT(first->zones, 0U);
  EXPECT_EQ(database_->call([](Repositories& r) { return r.materials.zones(PanelId{"P-0001"}); })->size(),
            first->zones);
  auto before = panel();
  auto mask = library_.load_mask(before);
  ASSERT_TRUE(mask.ok());
  ASSERT_TRUE(before.usable);
  EXPECT_NEAR(before.usable->count(), wood_area(*mask).count(), 1e-6);  // kept, so that no list decodes a mask
  const cv::Rect taken(mask->pixels.cols / 3, mask->pixels.rows / 3, 150, 120);
  ASSERT_GT(cv::countNonZero(mask->pixels(taken)), 1000);
  mask->pixels(taken).setTo(0);
  auto stored = library_.store_picture(mask->pixels, "panels/P-0001", "mask");
  ASSERT_TRUE(stored.ok());
  ASSERT_TRUE(database_
                  ->call([&](Repositories& r) {
                    return r.panels.add_mask(before.id,
                                             {0, before.map_file, stored->file, before.map_hash, before.created_at}, 1);
                  })
                  .ok());
  // What the planner measured of the replaced map goes with it.
  const auto index = library_.index_dir() / "P-0001-0-3.index", other = library_.index_dir() / "P-0002-0-3.index";
  std::filesystem::create_directories(library_.index_dir());
  std::ofstream(index) << "x", std::ofstream(other) << "x";
  // What wood and ledger disagree about is told with the pieces whose wood it is.
  db::NewPlan plan;
  plan.name = "portrait", plan.who = "local:1000", plan.plan_json = "{}", plan.options_json = "{}";
  db::PlannedPatch& patch = plan.pieces.emplace_back();
  patch.mark = "A1";
  patch.panel = before.id;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {6.0, 0.0}, {6.0, 6.0}, {0.0, 6.0}}) {
    patch.artwork_outline.push_back(point<ArtworkFrame>(x, y));
    patch.panel_outline.push_back(point<PanelFrame>(20 + x, 20 + y));
  }
  patch.allocation = Region<PanelFrame>(patch.panel_outline);
  plan.planned_on = {{before.id, 2}};
  const auto job = database_->call([&](Repositories& r) { return r.jobs.create(plan, "2026-05-01T07:30:00.000Z"); });
  ASSERT_TRUE(job.ok()) << job.error().message;
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind != RegisterScans::kKind) return;
    calib::Difference gone;
    gone.place = point<PanelFrame>(22, 22);
    gone.shape = square(21, 21, 2);
    calib::Difference elsewhere = gone;
    // Around the piece: its box is all of the piece's wood, its shape none of it.
    elsewhere.shape = subtract(square(18, 18, 10), square(19, 19, 8));
    answer["differences"] = std::vector<calib::Difference>{gone, elsewhere};
  };
  auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  ASSERT_TRUE(again->differences);
  ASSERT_EQ(again->differences->size(), 2U);
  ASSERT_EQ(again->differences->front().pieces.size(), 1U);
  EXPECT_EQ(again->differences->front().pieces[0].mark, "A1");
  EXPECT_EQ(again->differences->front().pieces[0].job, *job);
  EXPECT_TRUE(again->differences->back().pieces.empty()) << "nobody's";
  ASSERT_EQ(kept().size(), 2U) << "until somebody decides";
  EXPECT_EQ(kept().back().pieces_json, R"([{"job":1,"mark":"A1","state":"reserved"}])");
  EXPECT_TRUE(kept().back().gone);
  EXPECT_FALSE(again->is_new);
  EXPECT_FALSE(std::filesystem::exists(index));
  EXPECT_TRUE(std::filesystem::exists(other));
  auto after = library_.load_mask(panel());
  ASSERT_TRUE(after.ok());
  EXPECT_EQ(cv::countNonZero(after->pixels(taken)), 0);
  EXPECT_NEAR(panel().usable.value().count(), wood_area(*after).count(), 1e-6);
  EXPECT_GT(cv::countNonZero(after->pixels), 10000);
}

// The map that a scan enters shows the hole: the next scan is not compared with that one.
TEST_F(ScanServiceTest, WoodThatIsGoneIsToldByEachScanUntilItIsBooked) {
  rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  const auto& strip = sheet.strips.at(1);
  const double x = (strip.x0 + strip.x1) / 2, y = (strip.y0 + strip.y1) / 2;
  sheet.gone.push_back({{x - 3, y - 3}, {x + 3, y - 3}, {x + 3, y + 3}, {x - 3, y + 3}});
  lay(sheet);
  for (int times = 0; times < 2; ++times) {
    const auto again = scan();
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(again->differences->size(), 1U) << times;
    ASSERT_EQ(kept().size(), 1U) << times;
    EXPECT_FALSE(kept().front().decision) << times;
  }
  EXPECT_NEAR(kept().front().area.count(), 36, 5) << "its corners are rounded";
  ASSERT_TRUE(database_->call([](Repositories& r) {
    return r.differences.decide(PanelId{"P-0001"}, {1}, db::DifferenceVerdict::kWrittenOff, "local:1000", "",
                                "2026-05-01T07:30:00.000Z");
  }));
  const auto last = scan();
  ASSERT_TRUE(last.ok()) << last.error().message;
  EXPECT_TRUE(last->differences->empty());
  EXPECT_EQ(kept().size(), 1U);
}

// The first map is lost, as it may be after a restore: the oldest that is left shows the wood, the newest the hole.
TEST_F(ScanServiceTest, WoodThatIsGoneIsToldByTheOldestMapThatIsLeft) {
  rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  const std::string first_map = panel().map_file;
  lay(sheet, 1.7);
  ASSERT_TRUE(scan().ok());
  const std::string second_map = panel().map_file;
  ASSERT_NE(second_map, first_map);
  const auto& strip = sheet.strips.at(1);
  const double x = (strip.x0 + strip.x1) / 2, y = (strip.y0 + strip.y1) / 2;
  sheet.gone.push_back({{x - 3, y - 3}, {x + 3, y - 3}, {x + 3, y + 3}, {x - 3, y + 3}});
  lay(sheet);
  ASSERT_TRUE(scan().ok());
  ASSERT_EQ(kept().size(), 1U);
  std::filesystem::remove(library_.path_of(first_map));
  lay(sheet, 1.9);
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->differences->size(), 1U);
  ASSERT_EQ(kept().size(), 1U);
  EXPECT_FALSE(kept().front().decision);
  // That one, too: what is compared shows nothing, and says nothing.
  std::filesystem::remove(library_.path_of(second_map));
  lay(sheet, 2.1);
  const auto last = scan();
  ASSERT_TRUE(last.ok()) << last.error().message;
  EXPECT_TRUE(last->differences->empty());
  EXPECT_FALSE(kept().front().decision);
}

// A scanner that reads files gives what somebody put there, for as long as nobody puts anything else there.
TEST_F(ScanServiceTest, APictureThatWasScannedBeforeIsNoScanOfToday) {
  const auto scans = [&] {
    return *database_->call([](Repositories& r) { return r.panels.scans(PanelId{"P-0001"}); });
  };
  ASSERT_TRUE(scan().ok());
  ASSERT_EQ(scans().size(), 1U);
  scanner_.repeats = true;
  const auto again = scan();
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kRefused);
  EXPECT_EQ(
      again.error().message,
      fmt::format("the picture of test:0 is the one that was scanned on {} already, and shows nothing of what was "
                  "cut since: scan the panel anew",
                  scans().front().taken_at));
  EXPECT_EQ(panel().mask_version, 1) << "nothing of it counts";
  EXPECT_EQ(scans().size(), 1U);
  scanner_.repeats = false;
  ASSERT_TRUE(scan().ok());
  EXPECT_EQ(scans().size(), 2U);
  // What was refused by somebody's eye is no news later either.
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind) answer["lost"] = 5000.0;
  };
  const auto waits = look();
  ASSERT_TRUE(waits.ok() && waits->proposal) << (waits ? "" : waits.error().message);
  ASSERT_TRUE(proposals_->refuse(*waits->proposal, "", "local:1000").ok());
  workers_.spoil = {};
  scanner_.repeats = true;
  EXPECT_EQ(scan().error().code, ErrorCode::kRefused);
  // Retired, its sheet may be scanned as a new one, but not as it was before it was cut.
  scanner_.repeats = false;
  ASSERT_TRUE(scan().ok());
  const Status retired =
      database_->call([](Repositories& r) { return r.panels.retire(PanelId{"P-0001"}, "warped", utc_timestamp()); });
  ASSERT_TRUE(retired) << retired.error().message;
  scanner_.repeats = true;
  EXPECT_EQ(look().error().code, ErrorCode::kRefused);
}

TEST_F(ScanServiceTest, ATileIsNoOtherTileOnceMore) {
  const Config config;
  ScanService service(scanner_, *database_, library_, workers_, *proposals_, config);
  ScanRequest more;
  more.more = true;
  const auto tile = [&] { return service.add_tile(more, [](double, const std::string&) {}, {}); };
  scanner_.repeats = true;
  EXPECT_FALSE(service.open());
  ASSERT_TRUE(tile().ok());
  const auto again = tile();
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kRefused);
  EXPECT_THAT(again.error().message, ::testing::HasSubstr("is a tile of this series already: move the panel"));
  scanner_.repeats = false;
  const auto next = tile();
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->tiles, 2U);
  ASSERT_TRUE(service.open()) << "which somebody else can go on with";
  EXPECT_EQ(service.open()->tiles, 2U);
  EXPECT_EQ(service.open()->face, Face::kShow);
  EXPECT_FALSE(service.open()->panel);
  more.panel = PanelId{"P-0001"};
  ASSERT_TRUE(tile().ok());
  more.panel.reset();
  ASSERT_TRUE(tile().ok());
  EXPECT_EQ(service.open()->tiles, 4U);
  EXPECT_EQ(service.open()->panel, PanelId{"P-0001"}) << "an earlier tile has named it";
  // The last one was there already: without a word for it the series would stand open for good.
  scanner_.repeats = true;
  more.more = false;
  EXPECT_THAT(tile().error().message, ::testing::HasSubstr("veneerctl panel scan --anew"));
  more.more = more.anew = true;
  const auto anew = tile();
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_EQ(anew->tiles, 1U);
  EXPECT_FALSE(service.open()->panel) << "of the series before";
}

// Nine tiles of a large panel are half an hour's work.
TEST_F(ScanServiceTest, OfASeriesThatIsRefusedOneTileIsScannedAgain) {
  const Config config;
  ScanService service(scanner_, *database_, library_, workers_, *proposals_, config);
  const auto tile = [&](bool more, std::optional<int> again = {}) {
    ScanRequest request;
    request.more = more, request.again = again, request.accept = true;
    return service.add_tile(request, [](double, const std::string&) {}, {});
  };
  bool dies = false;
  workers_.died = [&](const std::string& kind) { return dies && kind == RegisterScans::kKind; };
  EXPECT_EQ(tile(false, 1).error().code, ErrorCode::kNotFound) << "nothing was refused";
  ASSERT_TRUE(tile(true).ok());
  EXPECT_FALSE(service.kept());
  dies = true;
  const auto refused = tile(false);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("the 2 tiles are kept for a day"));
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("veneerctl panel scan --again 2"));
  ASSERT_TRUE(service.kept());
  EXPECT_EQ(service.kept()->tiles, 2U);
  EXPECT_FALSE(service.kept()->is_over(utc_timestamp(std::chrono::seconds(-1000)), true));
  EXPECT_TRUE(service.kept()->is_over(utc_timestamp(std::chrono::seconds(1000)), true));
  EXPECT_TRUE(service.kept()->is_over(utc_timestamp(std::chrono::seconds(-1000)), false));
  EXPECT_EQ(tile(false, 3).error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(tile(false, 1).ok()) << "as bad as before, and kept still";
  dies = false;
  scanner_.repeats = true;
  EXPECT_EQ(tile(false, 2).error().code, ErrorCode::kRefused) << "the picture of tile 1 is no new one";
  EXPECT_EQ(service.kept()->tiles, 2U) << "and the series stays";
  scanner_.repeats = false;
  const auto whole = tile(false, 2);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->tiles, 2U);
  EXPECT_FALSE(service.kept());
  EXPECT_EQ(tile(false, 1).error().code, ErrorCode::kNotFound) << "it is over";

  // Whoever just scans begins anew; a single tile is no series.
  ASSERT_TRUE(tile(true).ok());
  dies = true;
  ASSERT_FALSE(tile(false).ok());
  const auto single = tile(false);
  ASSERT_FALSE(single.ok());
  EXPECT_THAT(single.error().message, ::testing::Not(::testing::HasSubstr("are kept"))) << "there is but one";
  EXPECT_FALSE(service.kept());
  // Given up, by its age or where the disk runs short.
  ASSERT_TRUE(tile(true).ok());
  service.give_up_kept();
  ASSERT_FALSE(tile(false).ok()) << "nothing was refused yet, and nothing lost";
  EXPECT_TRUE(service.kept());
  service.give_up_kept();
  EXPECT_FALSE(service.kept());
  EXPECT_EQ(tile(false, 1).error().code, ErrorCode::kNotFound);
}

// Whoever cancels wants to go on otherwise, not to scan nine tiles once more; and what is refused at the very end, when
// the tiles lie in the data folder, is as dear.
TEST_F(ScanServiceTest, ASeriesThatIsCancelledOrRefusedAtItsEndIsKept) {
  ASSERT_TRUE(scan().ok());
  const Config config;
  ScanService service(scanner_, *database_, library_, workers_, *proposals_, config);
  std::stop_source cancel;
  const auto tile = [&](bool more, std::optional<int> again = {}) {
    ScanRequest request;
    request.more = more, request.again = again;
    return service.add_tile(
        request, [](double, const std::string&) {}, cancel.get_token());
  };
  ASSERT_TRUE(tile(true).ok());
  workers_.spoil = [&](const std::string& kind, nlohmann::json&) {
    if (kind == RegisterScans::kKind) cancel.request_stop();
  };
  const auto cancelled = tile(false);
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);
  ASSERT_TRUE(service.kept());
  EXPECT_EQ(service.kept()->tiles, 2U);
  cancel = {};
  // Retired while it is looked at, and put back.
  workers_.spoil = [&](const std::string& kind, nlohmann::json&) {
    if (kind != RegisterScans::kKind) return;
    ASSERT_TRUE(
        database_->call([](Repositories& r) { return r.panels.retire(PanelId{"P-0001"}, "warped", utc_timestamp()); }));
  };
  const auto late = tile(false, 2);
  ASSERT_FALSE(late.ok());
  ASSERT_TRUE(service.kept()) << late.error().message;
  workers_.spoil = {};
  ASSERT_TRUE(
      database_->call([](Repositories& r) { return r.panels.restore(PanelId{"P-0001"}, "flat", utc_timestamp()); }));
  const auto whole = tile(false, 1);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->tiles, 2U);
  EXPECT_FALSE(service.kept());
}

// What it was asked for with, nobody says again.
TEST_F(ScanServiceTest, ASeriesThatIsLookedAtAgainIsWhatItWasBefore) {
  ASSERT_TRUE(scan().ok());
  const Config config;
  ScanService service(scanner_, *database_, library_, workers_, *proposals_, config);
  const auto ask = [&](const ScanRequest& request) {
    return service.add_tile(request, [](double, const std::string&) {}, {});
  };
  rendered::Panel sheet = rendered::sample_panel();
  lay(sheet, 1.5, Face::kBack);
  ScanRequest back;
  back.face = Face::kBack, back.panel = PanelId{"P-0001"}, back.more = true;
  ASSERT_TRUE(ask(back).ok());
  EXPECT_EQ(service.open().value_or(ScanSeries::Open{}).panel, PanelId{"P-0001"});
  EXPECT_EQ(service.open().value_or(ScanSeries::Open{}).face, Face::kBack);
  bool dies = true;
  workers_.died = [&](const std::string& kind) { return dies && kind == RegisterScans::kKind; };
  back.more = false;
  ASSERT_FALSE(ask(back).ok());
  EXPECT_FALSE(service.open()) << "it is over, and kept";
  EXPECT_TRUE(service.kept());
  dies = false;
  ScanRequest again;
  again.again = 2;
  const auto whole = ask(again);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->face, Face::kBack);
  EXPECT_EQ(whole->panel, PanelId{"P-0001"});
}

// A folder's pictures come in turn: the one that was put there in the bad one's place is not the next one.
TEST_F(ScanServiceTest, OfAFolderThePictureThatIsNewIsTaken) {
  ASSERT_TRUE(std::filesystem::create_directory(folder_ / "glass"));
  const auto put = [&](const char* name, double turned) {
    lay(rendered::sample_panel(), turned);
    std::filesystem::copy_file(scanner_.file, folder_ / "glass" / name,
                               std::filesystem::copy_options::overwrite_existing);
  };
  put("a.ppm", 1.5), put("b.ppm", 2.0), put("c.ppm", 2.5);
  Config config;
  FileScanner files((folder_ / "glass").string());
  config.scanner.dpi = scanner_.nominal.dpi();
  ScanService service(files, *database_, library_, workers_, *proposals_, config);
  bool dies = true;
  workers_.died = [&](const std::string& kind) { return dies && kind == RegisterScans::kKind; };
  ScanRequest request;
  const auto ask = [&] { return service.add_tile(request, [](double, const std::string&) {}, {}); };
  request.more = true;
  ASSERT_TRUE(ask().ok());
  ASSERT_TRUE(ask().ok());
  request.more = false;
  ASSERT_FALSE(ask().ok());
  put("b.ppm", 2.2);
  dies = false;
  request.again = 2;
  const auto whole = ask();
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->tiles, 3U);
}

// Three pieces were being cut when the power went: one fell out, one is whole, one is broken in two.
TEST_F(ScanServiceTest, WhatAScanSeesOfSuspectPiecesIsProposedAndNotDecided) {
  rendered::Panel sheet = rendered::sample_panel();
  const auto first = scan();
  ASSERT_TRUE(first.ok()) << first.error().message;
  const double x = sheet.strips.at(1).x0 + 3;
  make_suspect(*database_, x);
  sheet.gone.push_back({{x, 30}, {x + 8, 30}, {x + 8, 38}, {x, 38}});
  sheet.gone.push_back({{x, 60}, {x + 4, 60}, {x + 4, 68}, {x, 68}});
  lay(sheet);
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->zones, first->zones) << "those that it had";
  ASSERT_EQ(again->suspects.size(), 3U);
  EXPECT_EQ(again->suspects[0].mark, "A30");
  EXPECT_EQ(again->suspects[0].sighting.seen, db::Seen::kCut);
  EXPECT_GT(again->suspects[0].sighting.gone, 0.95);
  EXPECT_EQ(again->suspects[1].sighting.seen, db::Seen::kStillThere);
  EXPECT_EQ(again->suspects[2].sighting.seen, db::Seen::kUnclear);
  EXPECT_NEAR(again->suspects[2].sighting.gone, 0.5, 0.1);
  // Seen again in a light that is no lamp's: what has changed is then not known of any of them.
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    calib::Reconciliation unfit;
    unfit.light_known = false;
    if (kind == RegisterScans::kKind) answer["warnings"] = doubts_of_comparison(unfit);
  };
  const auto dark = scan();
  ASSERT_TRUE(dark.ok()) << dark.error().message;
  ASSERT_EQ(dark->suspects.size(), 3U);
  for (const auto& suspect : dark->suspects) EXPECT_EQ(suspect.sighting.seen, db::Seen::kUnclear) << suspect.mark;
  const auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
  for (const auto& piece : *pieces) {
    EXPECT_EQ(piece.state, db::PieceState::kSuspect) << "a person decides";
    ASSERT_TRUE(piece.sighting);
    EXPECT_EQ(piece.sighting->mask_version, panel().mask_version);
  }
}

TEST_F(ScanServiceTest, AWideMarginAroundSuspectPiecesThatWereCutIsNoLostWood) {
  config_.mask.edge_margin = 2_mm;
  rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  const double x = sheet.strips.at(1).x0 + 3;
  make_suspect(*database_, x);
  for (const double y : {30.0, 45.0, 60.0}) sheet.gone.push_back({{x, y}, {x + 8, y}, {x + 8, y + 8}, {x, y + 8}});
  lay(sheet);
  double lost = -1;  // mm2
  workers_.spoil = [&](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind) lost = answer.get<PanelRead>().lost.count();
  };
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->suspects.size(), 3U);
  EXPECT_EQ(lost, 0);
}

TEST_F(ScanServiceTest, WhatTheMaskLeavesOutIsToldWithTheScan) {
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind) answer["warnings"] = std::vector<ScanWarning>{{"strip-1", "a strip is left out"}};
  };
  ScanRequest all_the_same;
  all_the_same.overrule = {"strip-1"};
  const auto scanned = scan(all_the_same);
  ASSERT_TRUE(scanned.ok()) << scanned.error().message;
  EXPECT_EQ(scanned->panel, PanelId{"P-0001"});
  EXPECT_EQ(scanned->warnings, (std::vector<ScanWarning>{{"strip-1", "a strip is left out"}}));
  workers_.spoil = {};

  // What should not have entered stock leaves it, and the same sheet is scanned as another panel.
  ASSERT_TRUE(database_->call([](Repositories& r) {
    return r.panels.retire(PanelId{"P-0001"}, "a strip was left out", "2026-05-01T07:30:00.000Z");
  }));
  const auto anew = scan();
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_TRUE(anew->is_new);
  EXPECT_EQ(anew->panel, PanelId{"P-0002"});
}

// Registration takes many seconds, and somebody else works on meanwhile.
TEST_F(ScanServiceTest, AScanOfAPanelThatIsRetiredMeanwhileIsNotEntered) {
  ASSERT_TRUE(scan().ok());
  const std::string before = panel().mask_file;
  workers_.spoil = [&](const std::string& kind, nlohmann::json&) {
    if (kind != RegisterScans::kKind) return;
    ASSERT_TRUE(database_->call(
        [](Repositories& r) { return r.panels.retire(PanelId{"P-0001"}, "split", "2026-05-01T07:30:00.000Z"); }));
  };
  const auto again = scan();
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kConflict);
  EXPECT_EQ(panel().mask_file, before);
}

// Kept for ever and read whenever somebody asks for it: what no process of ours would say must not get there.
TEST_F(ScanServiceTest, AnAnswerThatCannotBeOneEntersNothing) {
  using nlohmann::json;
  const std::vector<std::pair<const char*, std::function<void(json&)>>> spoilt = {
      {"a lattice without end", [](json& a) { a["lattices"][0] = std::string(100'000, '['); }},
      {"no lattice", [](json& a) { a["lattices"][0] = "[1]"; }},
      {"too few lattices", [](json& a) { a["lattices"] = json::array(); }},
      {"a sheet as wide as the world",
       [](json& a) {
         a["sheet"] = {{0, 0}, {1e300, 100}};
       }},
      {"a sheet of many metres",
       [](json& a) {
         a["sheet"] = {{0, 0}, {90'000, 100}};
       }},
      {"a sheet of nothing",
       [](json& a) {
         a["sheet"] = {{0, 0}, {0, 0}};
       }},
      {"a zone beyond all measure",
       [](json& a) {
         a["zones"][0]["shape"][0][0] = {1e18, 0};
       }},
      {"a zone of countless points",
       [](json& a) {
         a["zones"][0]["shape"][0] = json::array_t(20'000, json::array({1, 1}));
       }},
      {"a zone of many metres",
       [](json& a) {
         a["zones"][0]["shape"][0][0] = {90'000'000, 0};
       }},
      {"a strip as sure as nothing can be",
       [](json& a) {
         calib::AskedStrip strip;
         strip.confidence = 2, strip.reason = "it looks like the board";
         a["asked"] = std::vector<calib::AskedStrip>{strip};
       }},
      {"countless zones", [](json& a) { a["zones"] = json::array_t(20'000, a["zones"].at(0)); }},
      {"a suspect that nobody asked for", [](json& a) { a["suspects_gone"] = {0.5}; }},
      {"countless warnings",
       [](json& a) {
         a["warnings"] = std::vector<ScanWarning>(2'000, {"strip", "a strip is left out"});
       }},
      {"a difference beyond all measure",
       [](json& a) {
         calib::Difference difference;
         difference.shape = square(0, 0, 10);
         a["differences"] = std::vector<calib::Difference>{difference};
         a["differences"][0]["shape"][0][0] = {1e300, 0};
       }},
      {"a difference of many metres",
       [](json& a) {
         calib::Difference difference;
         difference.shape = square(0, 0, 90'000);
         a["differences"] = std::vector<calib::Difference>{difference};
       }},
      {"a difference of nothing",
       [](json& a) { a["differences"] = std::vector<calib::Difference>{calib::Difference()}; }},
      {"a warning without end",
       [](json& a) {
         a["warnings"] = std::vector<ScanWarning>{{"strip-1", std::string(100'000, 'a')}};
       }},
      {"a warning without a name",
       [](json& a) {
         a["warnings"] = std::vector<ScanWarning>{{"", "a strip is left out"}};
       }},
      {"another thing", [](json& a) { a = 3; }},
  };
  for (const auto& [what, change] : spoilt) {
    workers_.repeats = what != spoilt.front().first;
    workers_.spoil = [change = change](const std::string& kind, json& answer) {
      if (kind == RegisterScans::kKind) change(answer);
    };
    const auto scanned = scan();
    ASSERT_FALSE(scanned.ok()) << what;
    EXPECT_EQ(scanned.error().code, ErrorCode::kInternal) << what;
    EXPECT_TRUE(database_->call([](Repositories& r) { return r.panels.list(); })->empty()) << what;
  }
  workers_.spoil = {};
  workers_.repeats = false;
  EXPECT_TRUE(scan().ok());
}

}  // namespace
}  // namespace veneer::daemon
