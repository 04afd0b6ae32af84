// What scans propose, on rendered sheets: nothing is stock before somebody accepts it, and nothing is lost for good.
#include "daemon/stock/scan_proposals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "daemon/orders/panel_wood.h"
#include "daemon/orders/scan_json.h"
#include "daemon/stock/mask_painter.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/panel_merge.h"
#include "daemon/stock/scan_service.h"
#include "daemon/stock/stock_memory.h"
#include "tests/db/stray_sql.h"
#include "tests/support/one_picture.h"
#include "tests/support/rendered_panel.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const PanelId kFirst{"P-0001"}, kSecond{"P-0002"};

class ScanProposalsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    lay(sheet_);
    auto opened = DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    reader_ = std::move(*database_->open_reader());
    proposals_.emplace(*database_, library_, make_null_logger());
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kScanner;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    certificate.payload = to_payload(calib::ScannerCertificateData{}).dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  void lay(const rendered::Panel& sheet, double turned_deg = 1.5, Face face = Face::kShow) {
    rendered::Scanner glass;
    glass.dpi = 200, glass.width_mm = 180, glass.height_mm = 140;
    scanner_.nominal = glass.nominal();
    scanner_.file = folder_ / "scan.ppm";
    const auto pose = rendered::lay(sheet.width / 2, sheet.height / 2, 90, 70, turned_deg, face);
    ASSERT_TRUE(cv::imwrite(scanner_.file.string(), scan_panel(sheet, face, pose, glass)));
  }
  Result<ScanOutcome> scan(const ScanRequest& request = {}) {
    ScanService service(scanner_, *database_, library_, workers_, *proposals_, config_);
    return service.add_tile(request, [](double, const std::string&) {}, {});
  }
  ScanOutcome must_scan(bool accept = false, std::vector<std::string> overrule = {}) {
    ScanRequest request;
    request.accept = accept, request.overrule = std::move(overrule), request.who = "uid 7";
    auto seen = scan(request);
    EXPECT_TRUE(seen.ok()) << seen.error().message;
    return seen ? *seen : ScanOutcome{};
  }
  // One that is left out, where the board is, and the first that was taken.
  void ask_about_strips(std::vector<ScanWarning> further = {}) {
    workers_.spoil = [further](const std::string& kind, nlohmann::json& answer) {
      if (kind != RegisterScans::kKind) return;
      const auto asked = [](double left, double right, bool taken) {
        calib::AskedStrip strip;
        strip.outline = {point<PanelFrame>(left, 28), point<PanelFrame>(right, 28), point<PanelFrame>(right, 70),
                         point<PanelFrame>(left, 70)};
        strip.confidence = 0.4, strip.taken = taken, strip.reason = "it looks like the board";
        return strip;
      };
      std::vector<ScanWarning> warnings{{"strip-1", "a strip is left out"}, {"strip-2", "some is left out"}};
      warnings.insert(warnings.end(), further.begin(), further.end());
      answer["asked"] = std::vector<calib::AskedStrip>{asked(12, 22, false), asked(24, 46, true)};
      answer["warnings"] = warnings;
    };
  }
  Repositories& r() { return reader_->repositories(); }
  std::vector<db::PanelRecord> stock() { return *r().panels.in_stock(); }
  std::vector<db::ProposalRecord> waiting() { return *r().proposals.list(false); }
  int usable_pixels() { return cv::countNonZero(library_.load_mask(*r().panels.find(kFirst))->pixels); }
  int open_differences() { return r().panels.summaries(kFirst)->at(kFirst).open_differences; }
  bool is_usable(double x, double y) {
    const auto mask = library_.load_mask(*r().panels.find(kFirst));
    double column = 0, row = 0;
    mask->to_pixels(point<PanelFrame>(x, y), column, row);
    return mask->pixels.at<unsigned char>(static_cast<int>(row), static_cast<int>(column)) != 0;
  }
  void expect_true_book() {
    StockMemory memory(folder_ / "memory.json");
    PanelFigures figures(library_, memory);
    const auto panel = r().panels.find(kFirst);
    const auto book = figures.book(r(), *panel);
    ASSERT_TRUE(book.ok() && *book);
    const AreaBook& b = **book;
    EXPECT_NEAR((b.free + b.reserved + b.cut + b.kerf + b.suspect + b.scrap + b.unusable).count(), b.panel.count(),
                1e-6);
  }
  static db::MaskEdit edit(bool give, double x, double y, double side) {
    db::MaskEdit out;
    out.give = give;
    out.shape =
        Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, y), point<PanelFrame>(x + side, y),
                                            point<PanelFrame>(x + side, y + side), point<PanelFrame>(x, y + side)});
    out.who = "uid 7", out.at = "2026-05-01T07:30:00.000Z";
    return out;
  }

  Config config_;
  rendered::Panel sheet_ = rendered::sample_panel();
  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  std::unique_ptr<DatabaseReader> reader_;
  PanelLibrary library_{folder_.path()};
  testing::OnePicture scanner_;
  testing::WorkHere workers_;
  std::optional<ScanProposals> proposals_;
};

TEST_F(ScanProposalsTest, AFirstScanIsStockOnceItIsAccepted) {
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  EXPECT_FALSE(seen.panel);
  EXPECT_TRUE(seen.warnings.empty()) << seen.warnings.front().text;
  EXPECT_NEAR(seen.width.count(), 150, 0.2);
  EXPECT_TRUE(stock().empty());
  ASSERT_THAT(waiting(), SizeIs(1));
  const auto held = waiting().front();
  EXPECT_TRUE(std::filesystem::exists(library_.path_of(held.map_file)));
  EXPECT_FALSE(proposals_->accept(*seen.proposal, {"size"}, "uid 7").ok()) << "it has no such warning";

  const auto accepted = proposals_->accept(*seen.proposal, {}, "uid 7");
  ASSERT_TRUE(accepted.ok()) << accepted.error().message;
  EXPECT_EQ(accepted->panel, kFirst);
  ASSERT_THAT(stock(), SizeIs(1));
  EXPECT_GT(accepted->zones, 0U);
  EXPECT_EQ(r().materials.zones(kFirst)->size(), accepted->zones);
  EXPECT_THAT(*r().panels.scans(kFirst), SizeIs(1));
  EXPECT_TRUE(waiting().empty());
  const auto decided = r().proposals.find(*seen.proposal);
  EXPECT_EQ(decided->decision->verdict, db::ProposalVerdict::kAccepted);
  EXPECT_EQ(decided->decision->panel, kFirst);
  EXPECT_EQ(decided->decision->who, "uid 7");
  // Its pictures are the panel's now, the raw scan too.
  EXPECT_FALSE(std::filesystem::exists(library_.path_of(held.map_file)));
  EXPECT_TRUE(std::filesystem::exists(library_.path_of(stock().front().map_file)));
  EXPECT_TRUE(std::filesystem::exists(library_.path_of(held.scan_files.front())));
  expect_true_book();

  const auto again = proposals_->accept(*seen.proposal, {}, "uid 7");
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kConflict);
}

TEST_F(ScanProposalsTest, WarningsAreOverruledByTheirNames) {
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind)
      answer["warnings"] = std::vector<ScanWarning>{{"size", "not round"}, {"strip-1", "a strip is left out"}};
  };
  const ScanOutcome seen = must_scan(true, {"size"});
  ASSERT_TRUE(seen.proposal) << "one was not overruled";
  EXPECT_TRUE(stock().empty());
  const auto refused = proposals_->accept(*seen.proposal, {"size"}, "uid 7");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("--override strip-1"));
  ASSERT_TRUE(proposals_->accept(*seen.proposal, {"strip-1", "size"}, "uid 7").ok());
  EXPECT_THAT(r().proposals.find(*seen.proposal)->decision->overruled, SizeIs(2));
  EXPECT_THAT(stock(), SizeIs(1));
}

TEST_F(ScanProposalsTest, StripsThatAreAskedAboutAreWoodOrNotAsSomebodySays) {
  ask_about_strips();
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  ASSERT_THAT(waiting().front().asked, SizeIs(2));
  EXPECT_EQ(waiting().front().asked[1].outline.front(), point<PanelFrame>(24, 28));
  EXPECT_FALSE(proposals_->accept(*seen.proposal, {"strip-2"}, "uid 7", {{"strip-3"}, {}}).ok()) << "no such strip";
  EXPECT_TRUE(stock().empty());

  const auto accepted = proposals_->accept(*seen.proposal, {}, "uid 7", {{"strip-1"}, {"strip-2"}});
  ASSERT_TRUE(accepted.ok()) << accepted.error().message;
  EXPECT_TRUE(is_usable(17, 40)) << "it was left out";
  EXPECT_FALSE(is_usable(12.2, 40)) << "the margin from its side";
  EXPECT_FALSE(is_usable(30, 40)) << "it was taken";
  const auto edits = *r().masks.counting(kFirst);
  ASSERT_THAT(edits, SizeIs(2));
  EXPECT_TRUE(edits[0].give);
  EXPECT_EQ(edits[0].note, "strip-1");
  EXPECT_EQ(edits[1].who, "uid 7");
  const auto zones = *r().materials.zones(kFirst);
  EXPECT_THAT(zones, SizeIs(seen.zones)) << "one less, one more";
  EXPECT_TRUE(zones.back().shape.contains(point<PanelFrame>(17, 40)));
  EXPECT_EQ(zones.back().confidence, 0.4);
  expect_true_book();

  workers_.spoil = nullptr;
  must_scan(true);
  EXPECT_TRUE(is_usable(17, 40)) << "a layer over what later scans see";
  EXPECT_FALSE(is_usable(30, 40));
}

TEST_F(ScanProposalsTest, AnAnswerThatCannotBeWrittenEntersNothing) {
  ask_about_strips();
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  // As a power cut between the two would.
  ASSERT_EQ(
      db::stray(folder_ / "test.db",
                "CREATE TRIGGER fault BEFORE INSERT ON mask_edits BEGIN SELECT RAISE(ABORT, 'no more power'); END"),
      "");
  const auto accepted = proposals_->accept(*seen.proposal, {}, "uid 7", {{}, {"strip-1", "strip-2"}});
  ASSERT_FALSE(accepted.ok());
  EXPECT_THAT(accepted.error().message, HasSubstr("no more power"));
  EXPECT_TRUE(stock().empty()) << "what is no wood could be planned from";
  EXPECT_THAT(waiting(), SizeIs(1));
}

TEST_F(ScanProposalsTest, AGivenStripKeepsTheMarginsOfTheConfiguration) {
  config_.mask.edge_margin = 2_mm;
  ask_about_strips();
  const ScanOutcome seen = must_scan();
  config_.mask.edge_margin = 0.5_mm;
  const auto accepted = proposals_->accept(*seen.proposal, {"strip-2"}, "uid 7", {{"strip-1"}, {}});
  ASSERT_TRUE(accepted.ok()) << accepted.error().message;
  EXPECT_FALSE(is_usable(13.5, 40)) << "that the scan was made with";
  EXPECT_TRUE(is_usable(14.5, 40));
  EXPECT_NEAR(accepted->usable.count(), usable_pixels() / std::pow(kMapResolution.px_per_mm, 2), 1);
}

TEST_F(ScanProposalsTest, AStripThatIsWoodOfAPanelThatKeepsItsZonesIsToldToBeNone) {
  ASSERT_TRUE(must_scan(true).panel);
  const auto zones = r().materials.zones(kFirst)->size();
  ask_about_strips({{"unproven-1", "nobody could tell"}});
  lay(sheet_, 2.1);
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  std::vector<std::string> all{"strip-2"};
  for (const auto& warning : seen.warnings)
    if (!warning.name.starts_with("strip-")) all.push_back(warning.name);
  const auto accepted = proposals_->accept(*seen.proposal, all, "uid 7", {{"strip-1"}, {}});
  ASSERT_TRUE(accepted.ok()) << accepted.error().message;
  EXPECT_TRUE(is_usable(17, 40));
  EXPECT_EQ(r().materials.zones(kFirst)->size(), zones);
  EXPECT_THAT(accepted->warnings, Contains(Field(&ScanWarning::text, HasSubstr("in none of the zones"))));
  EXPECT_THAT(*r().masks.counting(kFirst), SizeIs(1));
  // The scan's own version is the one that was accepted; the answer is behind it.
  EXPECT_EQ(r().proposals.find(*seen.proposal)->decision->mask_version, 2);
  EXPECT_EQ(r().panels.find(kFirst)->mask_version, 3);
  expect_true_book();
}

TEST_F(ScanProposalsTest, ASheetThatStandsOffTheGlassIsLookedAt) {
  cv::Mat picture = cv::imread(scanner_.file.string());
  cv::GaussianBlur(picture, picture, {}, 0.3 * scanner_.nominal.px_per_mm);
  ASSERT_TRUE(cv::imwrite(scanner_.file.string(), picture));
  const ScanOutcome seen = must_scan(true);
  ASSERT_THAT(seen.warnings, SizeIs(1));
  EXPECT_THAT(seen.warnings[0].name, ::testing::StartsWith("blurred-tag-"));
  EXPECT_TRUE(stock().empty()) << "--accept takes scans without warnings";
}

TEST_F(ScanProposalsTest, ABlurredScanOfAPanelInStockIsNoWoodUntilSomebodyLooked) {
  must_scan(true);
  ASSERT_THAT(stock(), SizeIs(1));
  cv::Mat picture = cv::imread(scanner_.file.string());
  cv::GaussianBlur(picture, picture, {}, 0.3 * scanner_.nominal.px_per_mm);
  ASSERT_TRUE(cv::imwrite(scanner_.file.string(), picture));
  const ScanOutcome seen = must_scan(true);
  EXPECT_THAT(seen.warnings, Contains(Field(&ScanWarning::name, ::testing::StartsWith("blurred-tag-"))));
  ASSERT_TRUE(seen.proposal);
  EXPECT_THAT(waiting(), SizeIs(1));
}

TEST_F(ScanProposalsTest, AnOverexposedScanIsNoWoodUntilSomebodyLooked) {
  const cv::Mat sound = cv::imread(scanner_.file.string());
  const auto scan_of = [&](const cv::Mat& picture) {
    EXPECT_TRUE(cv::imwrite(scanner_.file.string(), picture));
    return must_scan(true);
  };
  const auto of_light = ::testing::Contains(::testing::Field(&ScanWarning::name, "overexposed"));
  EXPECT_THAT(scan_of(sound * 1.6).warnings, of_light);
  EXPECT_TRUE(stock().empty());
  EXPECT_THAT(scan_of(sound).warnings, ::testing::Not(of_light));
  ASSERT_THAT(stock(), SizeIs(1));
  // Again, where the wood is: tags that are too bright would not be seen where they are known to be.
  cv::Mat bright = sound.clone(),
          middle = bright(cv::Rect(sound.cols / 4, sound.rows / 4, sound.cols / 2, sound.rows / 2));
  middle.convertTo(middle, -1, 1.6);
  const ScanOutcome again = scan_of(bright);
  EXPECT_THAT(again.warnings, of_light) << "although what looks otherwise is not in the new mask";
  EXPECT_TRUE(again.proposal);
}

TEST_F(ScanProposalsTest, OfABareBackNobodyIsToldThatItIsBlurred) {
  must_scan(true);
  lay(sheet_, 1.5, Face::kBack);
  cv::Mat picture = cv::imread(scanner_.file.string());
  cv::GaussianBlur(picture, picture, {}, 0.3 * scanner_.nominal.px_per_mm);
  ASSERT_TRUE(cv::imwrite(scanner_.file.string(), picture));
  ScanRequest request;
  request.panel = kFirst, request.face = Face::kBack;
  const auto seen = scan(request);
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_EQ(seen->face, Face::kBack);
  EXPECT_THAT(seen->warnings, ::testing::IsEmpty());
}

TEST_F(ScanProposalsTest, TheMaskKeepsTheMarginsOfTheConfiguration) {
  const double usual = must_scan().usable.count();
  config_.mask.edge_margin = 2_mm;
  const double wide = must_scan().usable.count();
  config_.mask.edge_margin = 0.5_mm, config_.mask.round_margin = 3_mm;
  const double round = must_scan().usable.count();
  EXPECT_LT(wide, 0.95 * usual);
  EXPECT_LT(round, usual - 10 * static_cast<double>(sheet_.screws.size()));
}

TEST_F(ScanProposalsTest, ARefusedScanLeavesNothing) {
  const ScanOutcome seen = must_scan();
  const auto held = waiting().front();
  ASSERT_TRUE(proposals_->refuse(*seen.proposal, "dust", "uid 7").ok());
  EXPECT_TRUE(stock().empty());
  EXPECT_TRUE(waiting().empty());
  for (const std::string& file : {held.map_file, held.mask_file, held.read_file, held.scan_files.front()})
    EXPECT_FALSE(std::filesystem::exists(library_.path_of(file))) << file;
  EXPECT_EQ(proposals_->refuse(*seen.proposal, "", "uid 7").error().code, ErrorCode::kConflict);
  EXPECT_EQ(must_scan(true).panel, kFirst) << "and the sheet can be scanned again";
}

TEST_F(ScanProposalsTest, ALaterScanOfTheSheetTakesThePlaceOfOneThatWaits) {
  const ScanOutcome first = must_scan();
  lay(sheet_, 2.5);
  const ScanOutcome second = must_scan();
  ASSERT_THAT(waiting(), SizeIs(1));
  EXPECT_EQ(waiting().front().id, *second.proposal);
  const auto late = proposals_->accept(*first.proposal, {}, "uid 7");
  ASSERT_FALSE(late.ok());
  EXPECT_THAT(late.error().message, HasSubstr("replaced"));
  EXPECT_TRUE(proposals_->accept(*second.proposal, {}, "uid 7").ok());
}

// The picture broke off, or somebody left a sheet of paper on the glass: much of the wood is not to be seen.
TEST_F(ScanProposalsTest, AScanThatWouldTakeMuchWoodWaitsAndTakesNothingForGood) {
  ASSERT_EQ(must_scan(true).panel, kFirst);
  const int before = usable_pixels();
  rendered::Panel spoilt = sheet_;
  spoilt.strips.erase(spoilt.strips.begin() + 1);
  lay(spoilt);
  const ScanOutcome seen = must_scan(true);
  ASSERT_TRUE(seen.proposal);
  EXPECT_EQ(seen.panel, kFirst);
  ASSERT_FALSE(seen.warnings.empty());
  EXPECT_TRUE(std::ranges::any_of(seen.warnings, [](const auto& w) { return w.name == "lost-wood"; }));
  EXPECT_GT(seen.lost.count(), 500);
  EXPECT_EQ(usable_pixels(), before);
  // Until it is decided nobody knows which wood is there.
  const Status surface = r().facts.check_surface(kFirst);
  ASSERT_FALSE(surface.ok());
  EXPECT_THAT(surface.error().message, HasSubstr("panel accept"));
  EXPECT_FALSE(r().panels.check_seen(kFirst).ok());
  ASSERT_TRUE(proposals_->refuse(*seen.proposal, "spoilt", "uid 7").ok());
  EXPECT_TRUE(r().facts.check_surface(kFirst).ok());
  EXPECT_EQ(usable_pixels(), before);
  EXPECT_TRUE(std::filesystem::exists(library_.path_of(r().panels.find(kFirst)->map_file)));

  // Accepted by mistake: it is taken back, with what it found.
  const ScanOutcome again = must_scan();
  std::vector<std::string> all;
  for (const auto& warning : again.warnings) all.push_back(warning.name);
  ASSERT_TRUE(proposals_->accept(*again.proposal, all, "uid 7").ok());
  EXPECT_LT(usable_pixels(), before);
  const auto back = revert_mask(r(), *database_, library_, kFirst, std::nullopt, "uid 7");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(usable_pixels(), before);
  EXPECT_EQ(open_differences(), 0);
  lay(sheet_, 2.1);
  const ScanOutcome sound = must_scan(true);
  EXPECT_FALSE(sound.proposal);
  EXPECT_GT(usable_pixels(), before * 98 / 100);
  expect_true_book();
}

TEST_F(ScanProposalsTest, WhatAScanFoundIsNotOpenAnyMoreOnceItIsTakenBack) {
  ASSERT_TRUE(must_scan(true).panel);
  rendered::Panel sheet = sheet_;
  const auto& strip = sheet.strips.at(1);
  const double x = (strip.x0 + strip.x1) / 2, y = (strip.y0 + strip.y1) / 2;
  sheet.gone.push_back({{x - 3, y - 3}, {x + 3, y - 3}, {x + 3, y + 3}, {x - 3, y + 3}});
  lay(sheet);
  const ScanOutcome second = must_scan(true);
  EXPECT_FALSE(second.proposal) << "a hole of 36 mm2 is told, and taken";
  EXPECT_EQ(open_differences(), 1);
  lay(sheet_, 1.9);
  must_scan(true);
  EXPECT_EQ(open_differences(), 0) << "not seen again";
  // The scan that did not see it is taken back, then the one that did, then both count again.
  const auto revert = [&](std::optional<int> version) {
    const auto done = revert_mask(r(), *database_, library_, kFirst, version, "uid 7");
    ASSERT_TRUE(done.ok()) << done.error().message;
  };
  revert(std::nullopt);
  EXPECT_EQ(open_differences(), 1);
  revert(std::nullopt);
  EXPECT_EQ(open_differences(), 0);
  revert(2);
  EXPECT_EQ(open_differences(), 1);
  revert(1);
  revert(2);
  EXPECT_EQ(open_differences(), 1) << "once";
}

TEST_F(ScanProposalsTest, WoodIsGivenBackAndWithheldByHandAndScansKeepThat) {
  ASSERT_TRUE(must_scan(true).panel);
  const int before = usable_pixels();
  const auto& strip = sheet_.strips.at(1);
  const double x = (strip.x0 + strip.x1) / 2, y = strip.y0 + 12;
  const double rim = 3;  // board
  ASSERT_TRUE(is_usable(x, y));
  ASSERT_FALSE(is_usable(rim + 2, y));
  const auto withheld = edit_mask(r(), *database_, library_, kFirst, edit(false, x - 5, y - 5, 10));
  ASSERT_TRUE(withheld.ok()) << withheld.error().message;
  EXPECT_FALSE(is_usable(x, y));
  // Never too little: pixels that the outline, of 40 mm, cuts through are withheld as well.
  const double taken = (withheld->before - withheld->usable).count();
  EXPECT_GE(taken, 100);
  EXPECT_LE(taken, 100 + 40 * 2 / kMapResolution.px_per_mm);
  const auto given = edit_mask(r(), *database_, library_, kFirst, edit(true, rim, y, 4));
  ASSERT_TRUE(given.ok()) << given.error().message;
  EXPECT_TRUE(is_usable(rim + 2, y + 2));
  expect_true_book();
  EXPECT_EQ(edit_mask(r(), *database_, library_, kFirst, edit(true, 500, 500, 4)).error().code,
            ErrorCode::kInvalidArgument);
  // Not even by hand: a tag is no wood.
  const auto& tag = sheet_.tags.front();
  ASSERT_TRUE(edit_mask(r(), *database_, library_, kFirst, edit(true, tag.x - 8, tag.y - 8, 16)).ok());
  EXPECT_FALSE(is_usable(tag.x, tag.y));

  lay(sheet_, 2.1);
  ASSERT_FALSE(must_scan(true).proposal) << "what was painted is nothing that the wood has lost";
  EXPECT_FALSE(is_usable(x, y));
  EXPECT_TRUE(is_usable(rim + 2, y + 2));
  // A panel that is painted on has not been scanned since: its surface is as old as the scan.
  const auto masks = r().panels.masks(kFirst);
  EXPECT_NE(masks->front().seen_file, masks->front().mask_file);

  // The scan is taken back, the edits stay; each is taken back alone.
  ASSERT_TRUE(revert_mask(r(), *database_, library_, kFirst, std::nullopt, "uid 7").ok());
  EXPECT_FALSE(is_usable(x, y));
  EXPECT_TRUE(is_usable(rim + 2, y + 2));
  const auto edits = r().masks.counting(kFirst);
  ASSERT_THAT(*edits, SizeIs(3));
  for (const auto& one : *edits) ASSERT_TRUE(remove_mask_edit(r(), *database_, library_, kFirst, one.id, "uid 7").ok());
  EXPECT_EQ(usable_pixels(), before);
  EXPECT_EQ(remove_mask_edit(r(), *database_, library_, kFirst, edits->front().id, "uid 7").error().code,
            ErrorCode::kConflict);
  expect_true_book();
}

// Given by hand, and then lost: a scan sees that, and what is no wood any more is not planned from.
TEST_F(ScanProposalsTest, WoodThatWasGivenAndIsGoneIsNotUsable) {
  ASSERT_TRUE(must_scan(true).panel);
  const auto& strip = sheet_.strips.at(1);
  const double x = (strip.x0 + strip.x1) / 2, y = strip.y0 + 12;
  ASSERT_TRUE(edit_mask(r(), *database_, library_, kFirst, edit(true, x - 6, y - 6, 12)).ok());
  rendered::Panel sheet = sheet_;
  sheet.gone.push_back({{x - 3, y - 3}, {x + 3, y - 3}, {x + 3, y + 3}, {x - 3, y + 3}});
  lay(sheet);
  ASSERT_FALSE(must_scan(true).proposal);
  EXPECT_FALSE(is_usable(x, y));
  EXPECT_TRUE(is_usable(x - 5, y - 5));
  ASSERT_TRUE(revert_mask(r(), *database_, library_, kFirst, std::nullopt, "uid 7").ok());
  EXPECT_TRUE(is_usable(x, y)) << "the scan that saw the hole was taken back";
}

// A step of it that fails, the disk that is full in its middle: what is accepted is stock whole, or it waits as before.
TEST_F(ScanProposalsTest, ALaterScanThatCannotBeEnteredWholeChangesNothing) {
  ASSERT_TRUE(must_scan(true).panel);
  const auto scans = r().panels.scans(kFirst)->size();
  rendered::Panel spoilt = sheet_;
  spoilt.strips.erase(spoilt.strips.begin() + 1);
  lay(spoilt);
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind != RegisterScans::kKind) return;
    auto read = answer.get<PanelRead>();
    ASSERT_TRUE(read.differences);
    const Region<PanelFrame> flat(MicroArea{{{{20'000, 30'000}, {25'000, 30'000}, {22'000, 30'000}}}});
    read.differences->push_back({calib::DifferenceKind::kGoneNotBooked, {}, flat, SquareMillimetres(4)});
    answer = read;
  };
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  std::vector<std::string> all;
  for (const auto& warning : seen.warnings) all.push_back(warning.name);
  const auto accepted = proposals_->accept(*seen.proposal, all, "uid 7");
  ASSERT_FALSE(accepted.ok()) << "a difference without a shape";
  EXPECT_EQ(r().panels.find(kFirst)->mask_version, 1);
  EXPECT_THAT(*r().panels.scans(kFirst), SizeIs(scans));
  EXPECT_EQ(open_differences(), 0);
  ASSERT_THAT(waiting(), SizeIs(1));
  EXPECT_FALSE(r().panels.check_seen(kFirst).ok()) << "nothing is cut from it before somebody decides";
  const auto raw = waiting().front().scan_files.front();
  ASSERT_TRUE(proposals_->refuse(*seen.proposal, "spoilt", "uid 7").ok());
  EXPECT_FALSE(std::filesystem::exists(library_.path_of(raw)));
}

TEST_F(ScanProposalsTest, ASheetWhoseZonesCannotBeEnteredIsNoPanel) {
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind) answer["zones"].push_back(answer["zones"].front());
  };
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  ASSERT_FALSE(proposals_->accept(*seen.proposal, {}, "uid 7").ok()) << "two zones of one number";
  EXPECT_TRUE(stock().empty());
  ASSERT_THAT(waiting(), SizeIs(1));
  EXPECT_TRUE(std::filesystem::exists(library_.path_of(waiting().front().scan_files.front())));
}

// The back has tags of its own, strips of nothing, and the same holes the other way round.
TEST_F(ScanProposalsTest, ABackThatIsTakenForANewSheetIsNoticedAndCanBeTied) {
  ASSERT_EQ(must_scan(true).panel, kFirst);
  // Veneered on both sides, or no mask would find wood.
  rendered::Panel back = rendered::sample_panel();
  for (auto& tag : back.tags) tag.x = back.width - tag.x, tag.id += tag.face == Face::kShow ? 100 : 0;
  std::erase_if(back.tags, [](const auto& tag) { return tag.face == Face::kBack; });
  for (auto& hole : back.holes) hole.x = back.width - hole.x;
  for (auto& strip : back.strips) {
    const double x0 = back.width - strip.x1;
    strip.x1 = back.width - strip.x0, strip.x0 = x0;
  }
  back.screws.clear();
  lay(back);
  const ScanOutcome seen = must_scan();
  ASSERT_TRUE(seen.proposal);
  const auto doubt =
      std::ranges::find_if(seen.warnings, [](const auto& warning) { return warning.name == "wrong-face"; });
  ASSERT_NE(doubt, seen.warnings.end());
  EXPECT_THAT(doubt->text, HasSubstr("--face back --panel P-0001"));
  std::vector<std::string> all;
  for (const auto& warning : seen.warnings) all.push_back(warning.name);
  ASSERT_EQ(proposals_->accept(*seen.proposal, all, "uid 7")->panel, kSecond);

  const auto merged = merge_panels(r(), *database_, kFirst, kSecond, "uid 7");
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_EQ(merged->kept_from_merged.handedness(), Handedness::kImproper);
  EXPECT_THAT(stock(), SizeIs(1));
  EXPECT_TRUE(to_calib(*r().panels.fiducials(kFirst)).knows(Face::kBack)) << "its tags are the back's";
  EXPECT_TRUE(r().panels.check_seen(kFirst).ok());
  EXPECT_FALSE(database_->call([](Repositories& w) { return w.panels.restore(kSecond, "again", "2026-05-01"); }).ok());
  // The back is found by them now.
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->panel, kFirst);
  EXPECT_EQ(again->face, Face::kBack);
}

}  // namespace
}  // namespace veneer::daemon
