// What makes somebody look at a first scan.
#include "daemon/orders/scan_doubts.h"

#include <gmock/gmock.h>

#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

Box<PanelFrame> between(double x0, double y0, double x1, double y1) {
  Box<PanelFrame> out;
  out.add(point<PanelFrame>(x0, y0));
  out.add(point<PanelFrame>(x1, y1));
  return out;
}

struct Sheet {
  std::vector<calib::TileView> views;
  calib::Registration registration;
  calib::VeneerMask mask;

  // Two upright tags and one that is turned, all longer by these shares along the scanner's axes; 10 pixels a mm.
  Sheet(double longer_x, double longer_y, Box<PanelFrame> bounds = between(0, 0, 240, 160)) {
    const auto resolution = ScanResolution::from_dpi(254);
    calib::TileView& view = views.emplace_back();
    view.nominal = resolution;
    for (int i = 0; i < 3; ++i) {
      calib::Tag<ScanFrame>& tag = view.tags.emplace_back();
      tag.id = 200 + i;
      const double turn = i * 0.2, side = calib::kPanelTagSize.count() * 10;
      for (int k = 0; k < 4; ++k) {
        const double u = k == 1 || k == 2 ? side : 0, v = k >= 2 ? side : 0;
        tag.corners.at(static_cast<std::size_t>(k)) =
            point<ScanFrame>(500 * (i + 1) + (u * std::cos(turn) - v * std::sin(turn)) * (1 + longer_x),
                             400 + (u * std::sin(turn) + v * std::cos(turn)) * (1 + longer_y));
      }
      calib::PanelTag& known = registration.fiducials.tags.emplace_back();
      known.id = tag.id;
    }
    registration.tiles.emplace_back(Isometry2<PanelFrame, GlassFrame>(), calib::ScannerModel(calib::ScannerModelData{}),
                                    resolution);
    registration.sheet = bounds;
    for (const double x : {20.0, 62.0, 104.0}) strip(x, x + 40);
  }
  void strip(double from, double to) {
    calib::Zone& zone = mask.list.emplace_back();
    zone.box = between(from, 20, to, 140);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& warning : doubts_of_first_scan(views, registration, mask)) out.push_back(warning.name);
    return out;
  }
};

TEST(ScanDoubts, ASoundScanHasNone) {
  EXPECT_THAT(Sheet(0, 0).names(), IsEmpty());
  EXPECT_THAT(Sheet(0.001, -0.001).names(), IsEmpty()) << "as printers are";
}

TEST(ScanDoubts, ALongHairIsToldAndAShortOneIsNot) {
  calib::VeneerMask mask;
  mask.hairs = {{point<PanelFrame>(40, 30), Millimetres(10)}};
  EXPECT_THAT(doubts_of_mask(mask), IsEmpty());
  mask.hairs.push_back({point<PanelFrame>(79, 112), Millimetres(20)});
  const auto doubts = doubts_of_mask(mask);
  ASSERT_EQ(doubts.size(), 1U);
  EXPECT_EQ(doubts[0].name, "dust");
  EXPECT_THAT(doubts[0].text,
              ::testing::HasSubstr("at 79 mm from the left and 112 mm from the lower edge (20 mm long): "));
}

TEST(ScanDoubts, OfTagsThatAreSeenLessSharplyThanFlatOnesTheWorstIsNamed) {
  const auto fine = ScanResolution::from_dpi(300), coarse = ScanResolution::from_dpi(75);
  const auto tag = [](int id, double blur) { return calib::TagSharpness{id, Millimetres(blur)}; };
  EXPECT_THAT(doubts_of_sharpness("scan 3", {}, fine), IsEmpty());
  EXPECT_THAT(doubts_of_sharpness("scan 3", {tag(211, 0.07), tag(212, 0.19)}, fine), IsEmpty());
  EXPECT_THAT(doubts_of_sharpness("scan 3", {tag(212, 0.3)}, coarse), IsEmpty()) << "less than a pixel";
  const auto one = doubts_of_sharpness("scan 3", {tag(211, 0.07), tag(212, 0.24)}, fine);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].name, "blurred-tag-212");
  EXPECT_THAT(one[0].text, AllOf(HasSubstr("scan 3"), HasSubstr("tag 212"), HasSubstr("0.24 mm"),
                                 HasSubstr("scan again"), Not(HasSubstr("more"))));
  EXPECT_FALSE(leaves_out_what_is_in_doubt(one[0].name)) << "the wood there is taken all the same";
  const auto three = doubts_of_sharpness("scan 3", {tag(210, 0.3), tag(211, 0.5), tag(212, 0.24)}, fine);
  ASSERT_EQ(three.size(), 1U);
  EXPECT_EQ(three[0].name, "blurred-tag-211");
  EXPECT_THAT(three[0].text, HasSubstr("and 2 more"));
}

TEST(ScanDoubts, WoodThatIsTooLightOrTooDarkIsTold) {
  EXPECT_THAT(doubts_of_exposure({0.019, 0.019}), IsEmpty());
  const auto light = doubts_of_exposure({0.31, 0});
  ASSERT_EQ(light.size(), 1U);
  EXPECT_EQ(light[0].name, "overexposed");
  EXPECT_THAT(light[0].text, HasSubstr("31 % of the wood is shown so light"));
  const auto dark = doubts_of_exposure({0, 0.05});
  ASSERT_EQ(dark.size(), 1U);
  EXPECT_EQ(dark[0].name, "underexposed");
  EXPECT_TRUE(is_of_exposure(light[0].name) && is_of_exposure(dark[0].name));
  EXPECT_FALSE(is_of_exposure("dust"));
}

TEST(ScanDoubts, AScanInNoLampsLightIsLookedAt) {
  calib::Reconciliation compared;
  EXPECT_THAT(doubts_of_comparison(compared), IsEmpty());
  compared.light_known = false;
  const auto doubts = doubts_of_comparison(compared);
  ASSERT_EQ(doubts.size(), 1U);
  EXPECT_EQ(doubts[0].name, "light");
  EXPECT_TRUE(is_unfit_light(doubts[0]));
  EXPECT_THAT(doubts[0].text, ::testing::HasSubstr("let the lamp warm up, wipe the glass and scan again"));
}

TEST(ScanDoubts, AnAxisThatIsOffIsToldFromPrintsThatAre) {
  EXPECT_THAT(Sheet(0.008, -0.006).names(), ElementsAre("scales"));
  EXPECT_THAT(Sheet(0, 0.005).names(), ElementsAre("scales"));
  EXPECT_THAT(Sheet(-0.007, -0.007).names(), ElementsAre("tag-size"));
}

TEST(ScanDoubts, ASheetThatIsNotCutToWholeSizesIsLookedAtWhereItsScaleOrItsEdgeIsInDoubt) {
  EXPECT_THAT(Sheet(0, 0, between(0, 0, 240.4, 159.6)).names(), IsEmpty());
  EXPECT_THAT(Sheet(0.0033, 0.0033).names(), IsEmpty()) << "the printer made them longer";
  EXPECT_THAT(Sheet(0.0033, 0.0033, between(0, 0, 240.8, 160.7)).names(), ElementsAre("size")) << "301 dpi for 300";
  EXPECT_THAT(Sheet(0, 0.003, between(0, 0, 240, 161.2)).names(), ElementsAre("size")) << "one axis of the scanner";
  EXPECT_THAT(Sheet(0, 0, between(0, 0, 240, 96.8)).names(), ElementsAre("size")) << "broke off";
  EXPECT_THAT(Sheet(0, 0, between(18.8, 0, 240, 160)).names(), ElementsAre("size")) << "or its left side";
  EXPECT_THAT(Sheet(0, 0, between(0, 0, 240, 142.9)).names(), ElementsAre("size")) << "wood to 2.9 mm of the edge";
  EXPECT_THAT(Sheet(0, 0, between(0, 0, 240, 143.1)).names(), IsEmpty());
  Sheet odd(0, 0, between(0, 0, 238.1, 157.4));
  EXPECT_THAT(odd.names(), IsEmpty());
  odd.views.clear();
  EXPECT_THAT(odd.names(), ElementsAre("size")) << "nothing tells the scale";
}

TEST(ScanDoubts, ASheetThatRunsOffThePictureIsLookedAt) {
  // All of the sheet that is seen, to the right rim of the picture, and bare board there. 10 pixels a mm.
  Sheet sheet(0, 0, between(10, 10, 160.8, 170));
  sheet.mask.list.clear();
  sheet.strip(30, 70);
  calib::TileView& view = sheet.views.front();
  view.width_px = 1609, view.height_px = 2000;
  // The picture's y runs down.
  sheet.registration.tiles[0] = calib::ScanMap(Isometry2<PanelFrame, GlassFrame>(Radians(0), point<PanelFrame>(0, 200)),
                                               calib::ScannerModel(calib::ScannerModelData{}), view.nominal);
  const auto sees = [&](std::initializer_list<double> sides) {
    view.outline.clear();
    for (const double x : sides)
      for (const double y : {10.0, 170.0})
        view.outline.push_back(sheet.registration.tiles[0].inverse(point<PanelFrame>(x, y)));
  };
  sees({10, 160.8});
  ASSERT_NEAR(view.outline.back().x.count(), 1608, 1);
  ASSERT_NEAR(view.outline.back().y.count(), 300, 1);
  EXPECT_THAT(sheet.names(), ElementsAre("size"));
  view.width_px = 1700;
  EXPECT_THAT(sheet.names(), IsEmpty()) << "the lid is seen beside it";
  // Of several tiles, one ends in the middle of the sheet, which runs on in the next.
  view.width_px = 1001;
  sees({10, 100});
  EXPECT_THAT(sheet.names(), IsEmpty());
  sheet.registration.sheet = between(10, 10, 160, 170);
  view.width_px = 1601;
  sees({10, 160});
  EXPECT_THAT(sheet.names(), IsEmpty()) << "150 mm wide, as sheets are cut";
}

// Each second panel wanted a maintainer.
TEST(ScanDoubts, ASheetThatWasSawnByHandIsRemarkedUpon) {
  EXPECT_THAT(Sheet(0.001, -0.001, between(0, 0, 237.3, 158.1)).names(), IsEmpty());
  EXPECT_EQ(remark_on_size(Millimetres(237.3), Millimetres(158.1)),
            "the sheet measures 237.3 x 158.1 mm, which is not round, as of a sheet that was sawn by hand");
  EXPECT_EQ(remark_on_size(Millimetres(239.5), Millimetres(160.4)), std::nullopt);
}

TEST(ScanDoubts, BareBoardAsWideAsAStripIsTold) {
  Sheet sheet(0, 0);
  sheet.strip(180, 220);
  EXPECT_THAT(sheet.names(), ElementsAre("strip-missing"));
  // What is asked about was seen.
  calib::AskedStrip& asked = sheet.mask.asked.emplace_back();
  asked.outline = {point<PanelFrame>(146, 20), point<PanelFrame>(178, 20), point<PanelFrame>(178, 140),
                   point<PanelFrame>(146, 140)};
  EXPECT_THAT(sheet.names(), ElementsAre("strip-1"));
}

TEST(ScanDoubts, EachFiducialThatMovedIsToldOnceAndAHoleIsNotGluedOn) {
  calib::Registration seen;
  const auto tag = point<PanelFrame>(10, 20), hole = point<PanelFrame>(60, 30), other = point<PanelFrame>(90, 30);
  for (int tile = 0; tile < 2; ++tile) {
    seen.moved.push_back({212, tag, Millimetres(0.3)});
    seen.moved.push_back({-1, hole, Millimetres(0.2)});
  }
  seen.moved.push_back({-1, other, Millimetres(0.2)});
  const auto told = doubts_of_fiducials({}, seen);
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told[0].name, "moved-tag-212");
  EXPECT_THAT(told[0].text, HasSubstr("--retag"));
  EXPECT_EQ(told[1].name, "moved-hole-1");
  EXPECT_THAT(told[1].text, Not(HasSubstr("glue")));
  EXPECT_EQ(told[2].name, "moved-hole-2");
}

TEST(ScanDoubts, TilesThatProveNothingAreNamed) {
  calib::Registration seen;
  seen.agreement = {{5, Millimetres(0.02), {}}, {3, Millimetres(0.12), {}}, {2, std::nullopt, {}}};
  std::vector<calib::TileView> views(3);
  views[1].name = "scan 12", views[2].name = "scan 13";
  const auto told = doubts_of_fiducials(views, seen);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].name, "disagree-2");
  EXPECT_THAT(told[0].text, AllOf(HasSubstr("scan 12"), HasSubstr("0.12 mm")));
  EXPECT_FALSE(is_unproven(told[0]));
  EXPECT_EQ(told[1].name, "unproven-3");
  EXPECT_THAT(told[1].text, HasSubstr("scan 13 shows 2"));
  EXPECT_TRUE(is_unproven(told[1]));
}

TEST(ScanDoubts, OfAResolutionThatIsNotTheConfiguredOneNameBoth) {
  const auto told = [](double x, double y) {
    return doubts_of_resolution("sheet.tif", x, y, ScanResolution::from_dpi(300));
  };
  for (const auto& [x, y] : {std::pair(0.0, 0.0),
                             {300.0, 300.0},
                             {299.999, 300.001},
                             {72.0, 72.0},
                             {96.0, 96.0},
                             {72.009, 72.009},
                             {1.0, 1.0},
                             {299.72, 299.72},
                             {300.0, 0.0}}) {
    const auto doubts = told(x, y);
    ASSERT_TRUE(doubts.ok()) << x;
    EXPECT_TRUE(doubts->empty()) << x;
  }
  const auto near = told(301, 301), apart = told(300, 302);
  ASSERT_TRUE(near.ok() && apart.ok());
  ASSERT_EQ(near->size(), 1U);
  EXPECT_EQ(near->front().name, "dpi");
  EXPECT_THAT(near->front().text, AllOf(HasSubstr("sheet.tif says 301 dpi"), HasSubstr("300 dpi: scan at")));
  ASSERT_EQ(apart->size(), 1U);
  EXPECT_THAT(apart->front().text, HasSubstr("300 dpi along x and 302 along y"));
  const auto other = told(600, 600);
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, ErrorCode::kRefused);
  EXPECT_THAT(other.error().message, AllOf(HasSubstr("says 600 dpi"), HasSubstr("300 dpi: scan at")));
}

}  // namespace
}  // namespace veneer::daemon
