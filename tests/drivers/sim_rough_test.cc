// The twin's workshop: each kind of roughness is really there, and none of it on the bench.
#include "drivers/sim/roughness.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "drivers/sim/bed_light.h"
#include "drivers/sim/camera.h"
#include "drivers/sim/carriage.h"
#include "drivers/sim/sheet_maker.h"
#include "drivers/sim/tag_dirt.h"
#include "drivers/sim/wood.h"
#include "drivers/sim/world.h"
#include "tests/drivers/sim_sheets.h"
#include "tests/support/temp_directory.h"

namespace veneer::sim {
namespace {

using ::testing::Each;
using ::testing::Le;

TEST(Roughness, PresetsGrowUnkinderAndAreWrittenWhole) {
  const Roughness bench = *roughness_preset("bench"), workshop = *roughness_preset("workshop"),
                  rough = *roughness_preset("rough");
  EXPECT_EQ(bench, Roughness{});
  for (const RoughnessKnob& knob : roughness_knobs()) {
    EXPECT_LE(workshop.*knob.value, rough.*knob.value) << knob.name;
    EXPECT_GT(rough.*knob.value, 0) << knob.name;
    EXPECT_LE(rough.*knob.value, knob.most) << knob.name;
  }
  EXPECT_EQ(roughness_from(to_json(rough)), rough);
  EXPECT_EQ(roughness_from(nlohmann::json::object()), bench);
  EXPECT_FALSE(roughness_preset("clean"));
}

TEST(Roughness, StaysWithTheWorldThatWasBegunWithIt) {
  const testing::TempDirectory dir;
  TwinSettings settings;
  settings.rough = *roughness_preset("rough");
  ASSERT_TRUE(World::open(settings, dir.path(), make_null_logger()).ok());
  const auto again = World::open({}, dir.path(), make_null_logger());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ((*again)->truth().settings.rough, settings.rough);
}

TEST(Carriage, OnTheBenchGoesWhereTheAxesSay) {
  Carriage carriage({}, 1);
  carriage.homed(1);
  const MachineAxes axes{0.001, -0.002, 0.0005};
  const auto way = carriage.follow(axes, {10, 20}, {200, 30});
  ASSERT_EQ(way.size(), 2U);
  EXPECT_EQ(way[0].bed, axes.bed_from_commanded({10, 20}));
  EXPECT_EQ(way[1].bed, axes.bed_from_commanded({200, 30}));
}

TEST(Carriage, LagsBehindAMotorThatTurnsRound) {
  Roughness rough;
  rough.backlash_mm = 0.1;
  Carriage carriage(rough, 1);
  const MachineAxes exact;
  carriage.follow(exact, {0, 50}, {100, 50});
  const auto back = carriage.follow(exact, {100, 50}, {0, 50});
  // It stands where it was until the play of 0.1 mm is taken up, then follows half of it behind.
  ASSERT_EQ(back.size(), 3U);
  EXPECT_NEAR(back[0].bed.x, 99.95, 1e-9);
  EXPECT_NEAR(back[1].bed.x, 99.95, 1e-9);
  EXPECT_NEAR(back[1].share, 0.001, 1e-9);
  EXPECT_NEAR(back[2].bed.x, 0.05, 1e-9);
  const auto on = carriage.follow(exact, {0, 50}, {-5, 50});
  ASSERT_EQ(on.size(), 2U);
  EXPECT_NEAR(on[1].bed.x, -4.95, 1e-9);
}

TEST(Carriage, LiesElsewhereAfterEachHomingAndFollowsItsBelt) {
  Roughness rough;
  rough.homing_scatter_mm = 0.05;
  std::vector<double> places;
  for (int homing = 1; homing <= 20; ++homing) {
    Carriage carriage(rough, 7);
    carriage.homed(homing);
    places.push_back(std::abs(carriage.follow({}, {100, 100}, {101, 100})[0].bed.x - 100));
  }
  EXPECT_THAT(places, Each(Le(0.05)));
  EXPECT_GT(*std::max_element(places.begin(), places.end()), 0.02);
  Roughness wavy;
  wavy.belt_wave_mm = 0.03;
  double worst = 0;
  Carriage carriage(wavy, 7);
  for (const auto& place : carriage.follow({}, {0, 100}, {100, 100}))
    worst = std::max(worst, std::abs(place.bed.x - 100 * place.share));
  EXPECT_NEAR(worst, 0.03, 0.001);
  // With 16 teeth the same error comes again after 32 mm.
  const auto off = [&](double period, double x) {
    wavy.belt_period_mm = period;
    return Carriage(wavy, 7).follow({}, {x, 0}, {x, 0}).back().bed.x - x;
  };
  EXPECT_NEAR(off(32, 5), off(32, 37), 1e-9);
  EXPECT_GT(std::abs(off(40, 5) - off(40, 37)), 0.01);
}

// Of a cut 10 mm long, how many mm are open on average across its middle.
double open_width(const Sheet& sheet, bool along_x) {
  const Vec2 centre = sheet.pixel({30, 25});
  const int reach = static_cast<int>(1.0 * sheet.px_per_mm);
  double open = 0;
  for (int d = -reach; d <= reach; ++d) {
    const int r = static_cast<int>(centre.y) + (along_x ? d : 0), c = static_cast<int>(centre.x) + (along_x ? 0 : d);
    open += 1 - sheet.material.at<unsigned char>(r, c) / 255.0;
  }
  return open / sheet.px_per_mm;
}

TEST(RoughCut, IsWiderAcrossAnOvalSpotNarrowerBelowAndSooty) {
  const auto cut = [](bool along_x, double oval, double taper, double soot) {
    auto sheet = dotted_sheet(60, 50, {}, {}, 50);
    TrueBurn burn = stroke(BurnDepth::kThrough, SheetFace::kBack, 0.27, {{25, 25}, {35, 25}});
    if (!along_x) burn.points = {{30, 20}, {30, 30}};
    burn.oval_mm = oval, burn.taper_mm = taper, burn.soot_mm = soot;
    burn_stroke(*sheet, burn);
    return sheet;
  };
  EXPECT_NEAR(open_width(*cut(true, 0, 0, 0), true), 0.27, 0.01);
  EXPECT_NEAR(open_width(*cut(true, 0.06, 0, 0), true), 0.27, 0.01);
  EXPECT_NEAR(open_width(*cut(false, 0.06, 0, 0), false), 0.33, 0.01);
  EXPECT_NEAR(open_width(*cut(true, 0, 0.08, 0), true), 0.19, 0.01);
  const auto sooty = cut(true, 0, 0, 1);
  const Vec2 beside = sooty->pixel({30, 25.5});
  const cv::Point at(static_cast<int>(beside.x), static_cast<int>(beside.y));
  EXPECT_GT(sooty->engraved_back.at<unsigned char>(at), 20);
  EXPECT_EQ(sooty->engraved_front.at<unsigned char>(at), 0) << "soot lies where the beam came from";
  EXPECT_EQ(cut(true, 0, 0, 0)->engraved_back.at<unsigned char>(at), 0);
}

TEST(RoughPanel, StandsUpFromTheBedAndTheCameraSeesIt) {
  TwinSettings settings;
  settings.seed = 9, settings.camera.width_px = 2000, settings.camera.height_px = 1500;
  settings.camera.noise = 0, settings.camera.uneven_light = 0;
  const CellTruth truth = draw_cell_truth(settings);
  const BedCamera camera(truth.camera, truth.settings.bed);
  const auto sheet = dotted_sheet(90, 64, {{45, 32}, {10, 10}}, {}, 14);
  sheet->relief = {4, 0};
  EXPECT_NEAR(sheet->relief.lift(0.5, 0.2, SheetFace::kShow), 4, 1e-12);
  EXPECT_NEAR(sheet->relief.lift(0.5, 0.2, SheetFace::kBack), 0, 1e-12) << "on its back its ends are in the air";
  EXPECT_NEAR(sheet->relief.lift(0, 0.2, SheetFace::kBack), 4, 1e-12);
  const BedView view{sheet.get(), SheetFace::kShow, {0, false, {400, 280}}, 2.1};
  const cv::Mat picture = camera.picture(view, 1);
  for (const Vec2 dot : {Vec2{45, 32}, Vec2{10, 10}}) {
    const double height = 2.1 + sheet->relief.lift(dot.x / 90, dot.y / 64, SheetFace::kShow);
    const Vec2 expected = truth.camera.pixel(view.bed_from_sheet.place(dot), height);
    const Vec2 found = dark_centre(picture, expected, 9, 190);
    EXPECT_NEAR(found.x, expected.x, 0.2);
    EXPECT_NEAR(found.y, expected.y, 0.2);
    EXPECT_GT(length(expected - truth.camera.pixel(view.bed_from_sheet.place(dot), 2.1)), 1.0);
  }
}

PanelOrder panel_order(const Roughness& rough) {
  PanelOrder order{"P", 200, 140, 2, 200, 100, 5};
  order.rough = rough;
  return order;
}

TEST(RoughPanel, HasDirtyTagsOtherBoardsAndWoods) {
  const auto clean = *make_panel(panel_order({}));
  Roughness rough;
  rough.tag_dirt = 1;
  const auto dirty = *make_panel(panel_order(rough));
  ASSERT_EQ(dirty->tags.size(), clean->tags.size());
  for (const auto& [mine, other, face] : {std::tuple{dirty->front, clean->front, SheetFace::kShow},
                                          std::tuple{dirty->back, clean->back, SheetFace::kBack}}) {
    cv::Mat changed;
    cv::absdiff(mine, other, changed);
    std::vector<cv::Point> where;
    cv::findNonZero(changed.reshape(1) > 0, where);
    ASSERT_FALSE(where.empty());
    for (const cv::Point& p : where) {
      const int column = p.x / 3;
      const Vec2 at = dirty->mm({column + 0.5, p.y + 0.5});
      double nearest = 1e9;
      for (const TrueTag& tag : dirty->tags)
        if (tag.face == face) nearest = std::min(nearest, length(at - (tag.corners[0] + tag.corners[2]) * 0.5));
      ASSERT_LT(nearest, 28) << at.x << ", " << at.y;
    }
  }
  rough = {};
  rough.other_boards = 1, rough.other_woods = 1, rough.thickness_mm = 0.2, rough.bow_mm = 1;
  const auto other = *make_panel(panel_order(rough));
  EXPECT_GT(cv::norm(other->front.at<cv::Vec3b>(3, 100), clean->front.at<cv::Vec3b>(3, 100)), 30);
  for (const SpeciesZone& zone : other->zones)
    EXPECT_TRUE(std::any_of(treated_woods().begin(), treated_woods().end(), [&](const WoodSpecies& w) {
      return w.name == zone.species;
    })) << zone.species;
  EXPECT_NE(other->thickness_mm, 2.1);
  EXPECT_NEAR(other->thickness_mm, 2.1, 0.2);
  EXPECT_FALSE(other->relief.flat());
}

TEST(RoughPanel, LosesATagsPlaceWhenItIsFirstLaidOnTheBed) {
  const testing::TempDirectory dir;
  TwinSettings settings;
  settings.sheet_dpi = 100;
  settings.rough.tag_slip_mm = 2;
  const auto world = *World::open(settings, dir.path(), make_null_logger());
  ASSERT_TRUE(world->new_panel("P", 200, 140, 2).ok());
  const auto glued = *world->sheet("P");
  ASSERT_TRUE(world->place("P", Spot::kBed, SheetFace::kBack, "whole", 0).ok());
  const auto slipped = *world->sheet("P");
  EXPECT_GT(cv::norm(glued->back, slipped->back, cv::NORM_L1), 0);
  EXPECT_EQ(cv::norm(glued->front, slipped->front, cv::NORM_L1), 0);
  ASSERT_EQ(slipped->tags.size(), glued->tags.size());
  for (std::size_t i = 0; i < glued->tags.size(); ++i) EXPECT_EQ(slipped->tags[i].corners, glued->tags[i].corners);
  ASSERT_TRUE(world->lift(Spot::kBed).ok());
  ASSERT_TRUE(world->place("P", Spot::kBed, SheetFace::kBack, "whole", 0).ok());
  EXPECT_EQ(cv::norm((*world->sheet("P"))->back, slipped->back, cv::NORM_L1), 0) << "once only";
  const auto again = *World::open(settings, dir.path(), make_null_logger());
  EXPECT_EQ(cv::norm((*again->sheet("P"))->back, slipped->back, cv::NORM_L1), 0);
}

TEST(RoughLight, ChangesFromPictureToPictureAndNeverOnTheBench) {
  const cv::Mat even(90, 120, CV_8UC3, cv::Scalar(100, 110, 120));
  const auto lit = [&](const Roughness& rough, std::uint64_t seed) {
    cv::Mat picture = even.clone();
    Random random(seed);
    light_the_bed(picture, rough, random);
    return picture;
  };
  const Roughness rough = *roughness_preset("rough");
  EXPECT_EQ(cv::norm(lit({}, 1), even, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(lit(rough, 1), lit(rough, 1), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(lit(rough, 1), lit(rough, 2), cv::NORM_INF), 10);
  for (const auto knob : {&Roughness::light_drift, &Roughness::light_slope, &Roughness::glare, &Roughness::shadow,
                          &Roughness::colour_drift, &Roughness::auto_exposure}) {
    Roughness one;
    one.*knob = rough.*knob;
    EXPECT_GT(cv::norm(lit(one, 3), even, cv::NORM_INF), 1);
  }
}

TEST(RoughScanner, RunsOtherwiseAtEachScanAndSaysSoInItsTruth) {
  TwinSettings settings;
  EXPECT_EQ(scanner_of_today(draw_cell_truth(settings), 3).warp_x, draw_cell_truth(settings).scanner.warp_x);
  settings.rough.scan_warp_mm = 0.03, settings.rough.scan_colour = 0.04;
  const CellTruth truth = draw_cell_truth(settings);
  double most = 0;
  for (std::uint64_t scan = 1; scan <= 20; ++scan) {
    const ScannerTruth today = scanner_of_today(truth, scan);
    EXPECT_NE(today.lamp, truth.scanner.lamp);
    for (const Vec2 at : {Vec2{10, 10}, Vec2{300, 20}, Vec2{160, 290}})
      most = std::max(most, length(today.glass_from_nominal(at) - truth.scanner.glass_from_nominal(at)));
    const Vec2 glass = today.glass_from_nominal({40, 250});
    EXPECT_LT(length(today.nominal_from_glass(glass) - Vec2{40, 250}), 1e-9);
  }
  EXPECT_GT(most, 0.01);
  EXPECT_LT(most, 0.09);
}

TEST(RoughGrid, IsPrintedTooLongOrTooShort) {
  const auto exact = make_grid("grid", 60, 4), off = make_grid("grid", 60, 4, 0.004);
  const auto pitch = [](const Sheet& sheet) { return length(sheet.tags[11].corners[0] - sheet.tags[0].corners[0]); };
  EXPECT_NEAR(pitch(*exact), 264, 0.01);
  EXPECT_GT(std::abs(pitch(*off) - 264), 0.05);
  EXPECT_LT(std::abs(pitch(*off) - 264), 1.1);
}

}  // namespace
}  // namespace veneer::sim
