#include "calib/reconcile.h"

#include <gmock/gmock.h>

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/calib/reconciled_sheet.h"

namespace veneer {
namespace {

using calib::Difference;
using calib::DifferenceKind;
using namespace reconciled;

TEST(Reconcile, FindsNothingWhenTheLedgerIsRight) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({}), shelf.map({kLight, kDark}, 0.05, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->differences.empty());
  EXPECT_NEAR(found->gone.count(), unite(regions_of({kLight, kDark})).area().count(), 15);
}

TEST(Reconcile, FindsWoodThatIsGoneButNotBooked) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({}), shelf.map({kLight, kDark, kBetween}, 0, 9), regions_of({kLight}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 2U);
  EXPECT_EQ(found->differences[0].kind, DifferenceKind::kGoneNotBooked);
  EXPECT_NEAR(found->differences[0].area.count(), region_of(kDark).area().count(), 8);
  EXPECT_TRUE(region_of(kDark).contains(found->differences[0].place));
  EXPECT_NEAR(found->differences[1].area.count(), region_of(kBetween).area().count(), 8);
  EXPECT_TRUE(region_of(kBetween).contains(found->differences[1].place));
}

// What is written off is what is gone, not the box around it.
TEST(Reconcile, TellsTheShapeOfWhatIsGone) {
  const Shelf shelf;
  const Outline corner = {{30, 30}, {44, 30}, {44, 33}, {33, 33}, {33, 46}, {30, 46}};
  const auto found = reconcile(shelf.map({}), shelf.map({corner}, 0, 9), {}, shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 1U);
  const auto& shape = found->differences[0].shape;
  EXPECT_NEAR(shape.area().count(), found->differences[0].area.count(), 2);
  EXPECT_LT(subtract(shape, offset(region_of(corner), Millimetres(0.4))).area().count(), 0.1);
  EXPECT_LT(subtract(offset(region_of(corner), Millimetres(-0.4)), shape).area().count(), 0.1);
}

TEST(Reconcile, FindsBookedWoodThatIsStillThere) {
  const Shelf shelf;
  const auto found = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->differences.size(), 1U);
  EXPECT_EQ(found->differences[0].kind, DifferenceKind::kBookedNotGone);
  EXPECT_TRUE(region_of(kDark).contains(found->differences[0].place));
}

TEST(Reconcile, CountsWhatWasGoneBeforeOnlyOnce) {
  const Shelf shelf;
  const auto found =
      reconcile(shelf.map({kLight}), shelf.map({kLight, kDark}, 0, 9), regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok());
  EXPECT_TRUE(found->differences.empty());
  const auto unknown = reconcile(shelf.map({kLight}), shelf.map({kLight}, 0, 9), {}, shelf.fiducials);
  ASSERT_TRUE(unknown.ok());
  EXPECT_TRUE(unknown->differences.empty());
}

TEST(Reconcile, ForgivesABorderWithinToleranceAndNoMore) {
  const Shelf shelf;
  const auto grown = offset(region_of(kLight), Millimetres(0.15), Corners::kMitred);
  const auto fine = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), {grown}, shelf.fiducials);
  ASSERT_TRUE(fine.ok());
  EXPECT_TRUE(fine->differences.empty());
  const auto shrunk = offset(region_of(kLight), Millimetres(-1.2), Corners::kMitred);
  const auto off = reconcile(shelf.map({}), shelf.map({kLight}, 0, 9), {shrunk}, shelf.fiducials);
  ASSERT_TRUE(off.ok());
  EXPECT_FALSE(off->differences.empty());
}

TEST(Reconcile, ForgivesTheWebBetweenTwoPiecesWhoseBookingsTouch) {
  const Shelf shelf;
  const Outline left = {{30, 30}, {41.85, 30}, {41.85, 44}, {30, 44}},
                right = {{42.15, 30}, {54, 30}, {54, 44}, {42.15, 44}};
  const Outline booked_left = {{29.85, 29.85}, {42, 29.85}, {42, 44.15}, {29.85, 44.15}};
  const Outline booked_right = {{42, 29.85}, {54.15, 29.85}, {54.15, 44.15}, {42, 44.15}};
  for (const std::uint64_t seed : {9, 10}) {
    const auto found = reconcile(shelf.map({}), shelf.map({left, right}, 0, seed),
                                 regions_of({booked_left, booked_right}), shelf.fiducials);
    ASSERT_TRUE(found.ok());
    EXPECT_TRUE(found->differences.empty()) << told(found->differences);
  }
}

TEST(Reconcile, TellsHowMuchOfAPieceIsGone) {
  const Shelf shelf;
  const auto found = reconcile(shelf.map({}), shelf.map({kLight, kBetween}, 0.05, 9), {}, shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const auto gone = [&](const Outline& outline) {
    return calib::share_gone(found->gone_mask, region_of(outline), 0.5_mm);
  };
  EXPECT_GT(gone(kLight), 0.98);
  EXPECT_LT(gone(kDark), 0.01);
  EXPECT_NEAR(gone({{36, 30}, {48, 30}, {48, 44}, {36, 44}}), 0.5, 0.06) << "half of it lies in the hole";
  EXPECT_EQ(gone({{30, 30}, {30.8, 30}, {30.8, 44}, {30, 44}}), 0) << "it has no inside";
  EXPECT_EQ(gone({{900, 30}, {912, 30}, {912, 44}, {900, 44}}), 0) << "beside the panel";
}

// What a scanner's own day makes of a map: a drift of colours, a slope of light, and JPEG.
void seen_on_another_day(Raster<PanelFrame>& map) {
  cv::Mat& pixels = map.pixels;
  for (int r = 0; r < pixels.rows; ++r)
    for (int c = 0; c < pixels.cols; ++c) {
      const double light = 0.96 + 0.06 * c / pixels.cols;
      auto& pixel = pixels.at<cv::Vec3b>(r, c);
      pixel = {cv::saturate_cast<std::uint8_t>(pixel[0] * light * 1.03 - 2),
               cv::saturate_cast<std::uint8_t>(pixel[1] * light),
               cv::saturate_cast<std::uint8_t>(pixel[2] * light * 0.97)};
    }
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", pixels, jpeg, {cv::IMWRITE_JPEG_QUALITY, 88});
  pixels = cv::imdecode(jpeg, cv::IMREAD_COLOR);
}

TEST(Reconcile, FindsNeutralWoodThatIsGoneOverAnyLid) {
  const GreyShelf shelf;
  for (const double lid : {240.0, 130.0, 24.0}) {
    auto now = shelf.map({}, 0.04, 9);
    for (const Outline& outline : {kLight, kDark, kBetween}) open_up(now, outline, cv::Scalar::all(lid));
    seen_on_another_day(now);
    const auto found = reconcile(shelf.map({}), now, regions_of({kDark}), shelf.fiducials);
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->differences.size(), 2U) << "lid " << lid << "\n" << told(found->differences);
    EXPECT_TRUE(region_of(kLight).contains(found->differences[0].place)) << "lid " << lid;
    EXPECT_NEAR(found->differences[0].area.count(), region_of(kLight).area().count(), 10) << "lid " << lid;
    EXPECT_TRUE(region_of(kBetween).contains(found->differences[1].place)) << "lid " << lid;
    EXPECT_NEAR(found->differences[1].area.count(), region_of(kBetween).area().count(), 6) << "lid " << lid;
  }
}

TEST(Reconcile, FindsNeutralWoodThatIsStillThereThoughItIsBooked) {
  const GreyShelf shelf;
  auto now = shelf.map({}, 0.04, 9);
  open_up(now, kLight, cv::Scalar::all(130));
  seen_on_another_day(now);
  const auto found = reconcile(shelf.map({}), now, regions_of({kLight, kDark, kBetween}), shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->differences.size(), 2U) << told(found->differences);
  for (const Difference& difference : found->differences) EXPECT_EQ(difference.kind, DifferenceKind::kBookedNotGone);
  EXPECT_TRUE(region_of(kDark).contains(found->differences[0].place));
  EXPECT_TRUE(region_of(kBetween).contains(found->differences[1].place));
}

TEST(Reconcile, ASheetThatNothingWasDoneToIsTheSameOnAnotherDay) {
  const GreyShelf grey;
  const Shelf warm;
  for (const Shelf* shelf : {&warm, static_cast<const Shelf*>(&grey)}) {
    auto now = shelf->map({}, -0.05, 9);
    seen_on_another_day(now);
    const auto found = reconcile(shelf->map({}), now, {}, shelf->fiducials);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_TRUE(found->differences.empty()) << told(found->differences);
  }
}

// Smoke darkens the wood around a cut by a share and leaves its grain.
TEST(Reconcile, SootAroundACutIsNoMissingWood) {
  const GreyShelf shelf;
  auto now = shelf.map({kLight, kDark}, 0, 9);
  cv::Mat smoke(now.pixels.size(), CV_32FC1, cv::Scalar(1));
  for (const double reach : {1.0, 0.7, 0.4}) {
    Raster<PanelFrame> ring = now;
    ring.pixels = cv::Mat::zeros(now.pixels.size(), CV_8UC1);
    for (const Outline& outline : {kLight, kDark})
      for (const auto& corners : offset(region_of(outline), Millimetres(reach)).rings()) {
        Outline wider;
        for (const auto& p : corners) wider.emplace_back(p.x.count(), p.y.count());
        open_up(ring, wider, cv::Scalar(255));
      }
    for (const Outline& outline : {kLight, kDark}) open_up(ring, outline, cv::Scalar(0));
    cv::Mat share;
    ring.pixels.convertTo(share, CV_32F, -0.05 / 255, 1);
    smoke = smoke.mul(share);
  }
  for (int r = 0; r < smoke.rows; ++r)
    for (int c = 0; c < smoke.cols; ++c)
      for (int k = 0; k < 3; ++k) {
        auto& level = now.pixels.at<cv::Vec3b>(r, c)[k];
        level = cv::saturate_cast<std::uint8_t>(level * smoke.at<float>(r, c));
      }
  const auto found = reconcile(shelf.map({}), now, regions_of({kLight, kDark}), shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->differences.empty()) << told(found->differences);
}

TEST(Reconcile, BesideTheWoodThatTheLedgerKnowsNothingIsTold) {
  const GreyShelf shelf;
  auto now = shelf.map({}, 0, 9), wood = now;
  open_up(now, kLight, cv::Scalar::all(24));
  open_up(now, kBetween, cv::Scalar::all(24));
  wood.pixels = cv::Mat(now.pixels.size(), CV_8UC1, cv::Scalar(255));
  open_up(wood, {{28, 28}, {44, 28}, {44, 46}, {28, 46}}, cv::Scalar(0));
  const auto found = reconcile(shelf.map({}), now, {}, shelf.fiducials, {}, &wood);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->differences.size(), 1U);
  EXPECT_TRUE(region_of(kBetween).contains(found->differences[0].place));
  wood.pixels = wood.pixels.rowRange(1, wood.pixels.rows);
  EXPECT_FALSE(reconcile(shelf.map({}), now, {}, shelf.fiducials, {}, &wood).ok());
}

double area_told(const std::vector<Difference>& differences, DifferenceKind kind) {
  double area = 0;
  for (const Difference& difference : differences)
    if (difference.kind == kind) area += difference.area.count();
  return area;
}

// What is learnt of a wood is then learnt of its loss: that must not be taken for noise.
TEST(Reconcile, WoodThatIsGoneForTheMostPartIsTold) {
  const Outline strip = {{24.7, 24}, {45.3, 24}, {45.3, 80}, {24.7, 80}},
                most = {{24, 24}, {100, 24}, {100, 80}, {24, 80}};
  const GreyShelf grey;
  const Shelf warm;
  const struct {
    const Shelf& shelf;
    Outline outline;
    double lid;
  } kCases[] = {{warm, strip, 24}, {grey, strip, 240}, {warm, most, 240}, {grey, most, 24}};
  for (const auto& [shelf, outline, lid] : kCases) {
    auto now = shelf.map({}, 0.04, 9);
    open_up(now, outline, cv::Scalar::all(lid));
    const auto found = reconcile(shelf.map({}), now, {}, shelf.fiducials);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_GT(area_told(found->differences, DifferenceKind::kGoneNotBooked), 0.8 * region_of(outline).area().count())
        << (&shelf == &warm ? "warm" : "grey") << ", lid " << lid << "\n"
        << told(found->differences);
  }
}

// A lamp's stray light at a place: a few hundredths less, over some centimetres.
void strayed(Raster<PanelFrame>& map, const cv::Point2d& place) {
  constexpr double kMost = 0.035, kReach = 12;  // of a level, mm
  for (int r = 0; r < map.pixels.rows; ++r)
    for (int c = 0; c < map.pixels.cols; ++c) {
      const auto p = map.from_pixels(c + 0.5, r + 0.5);
      const cv::Point2d off(p.x.count() - place.x, p.y.count() - place.y);
      const double light = 1 - kMost * std::exp(-off.dot(off) / (2 * kReach * kReach));
      for (int k = 0; k < 3; ++k) {
        auto& level = map.pixels.at<cv::Vec3b>(r, c)[k];
        level = cv::saturate_cast<std::uint8_t>(level * light);
      }
    }
}

// As at the second scan of a sheet of pale strips that is nearly used up: what is left are webs, the rims of the strips
// and here and there a place between, over a lid nearly as pale.
TEST(Reconcile, WhatIsLeftOfPaleWoodThatIsMostlyCutAwayIsSoundInStrayLight) {
  Shelf shelf;
  shelf.noise = 0.7;  // of 300 dpi in a work map
  for (std::size_t i = 0; i < shelf.panel.strips.size(); ++i)
    if (i % 2 == 0) shelf.panel.strips[i].colour = {178, 208, 226}, shelf.panel.strips[i].grain = 0.05;
  std::vector<Outline> gone;
  std::vector<cv::Point2d> left;
  int place = 0;
  for (const rendered::Strip& strip : shelf.panel.strips)
    for (double y = strip.y0 + 2; y < strip.y1 - 9; y += 9)
      for (double x = strip.x0 + 2; x < strip.x1 - 6; x += 7)
        if (++place % 7 != 0)
          gone.push_back({{x, y}, {x + 5.2, y + 0.3}, {x + 5.5, y + 7}, {x + 0.2, y + 6.6}});
        else
          left.emplace_back(x + 2.7, y + 3.4);
  const auto before = shelf.map({});
  auto now = shelf.map({}, 0.04, 9);
  for (const Outline& outline : gone) open_up(now, outline, cv::Scalar::all(238));
  strayed(now, left.front());
  const auto found = reconcile(before, now, regions_of(gone), shelf.fiducials);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->differences.empty()) << told(found->differences);
}

// Of which nobody knows whether they were cut out: were they learnt from, their loss would be the light's change.
TEST(Reconcile, PlacesInDoubtAreNotLearntFrom) {
  GreyShelf shelf;
  shelf.noise = 0.7;
  calib::ReconcileOptions options;
  const auto before = shelf.map({});
  auto now = shelf.map({}, 0.04, 9);
  std::vector<Outline> pieces;
  for (std::size_t i = 0; i < shelf.panel.strips.size(); ++i) {
    const rendered::Strip& strip = shelf.panel.strips[i];
    pieces.push_back(
        {{strip.x0, strip.y0}, {strip.x1, strip.y0}, {strip.x1, strip.y1 - 14}, {strip.x0, strip.y1 - 14}});
    open_up(now, pieces.back(), shelf.panel.strips[i].colour * 0.93F);
  }
  options.uncertain = regions_of(pieces);
  const auto found = reconcile(before, now, {}, shelf.fiducials, options);
  ASSERT_TRUE(found.ok()) << found.error().message;
  for (const Outline& piece : pieces)
    EXPECT_GT(calib::share_gone(found->gone_mask, region_of(piece), 0.5_mm), 0.85) << told(found->differences);
}

// Booked as wide as the strip is: beside it there is board, which looks otherwise, and no opening.
TEST(Reconcile, APieceAsWideAsItsStripThatWasNotCutIsTold) {
  const Shelf shelf;
  auto wood = shelf.map({});
  wood.pixels = cv::Mat(wood.pixels.size(), CV_8UC1, cv::Scalar(0));
  for (const rendered::Strip& strip : shelf.panel.strips)
    open_up(wood,
            {{strip.x0 + 0.5, strip.y0 + 0.5},
             {strip.x1 - 0.5, strip.y0 + 0.5},
             {strip.x1 - 0.5, strip.y1 - 0.5},
             {strip.x0 + 0.5, strip.y1 - 0.5}},
            cv::Scalar(255));
  const auto piece = [](double from, double to) { return Outline{{25.3, from}, {44.7, from}, {44.7, to}, {25.3, to}}; };
  const Outline below = piece(28, 38), between = piece(38.3, 48), above = piece(48.3, 58);
  const auto booked = regions_of({below, between, above});
  for (const auto& gone : std::vector<std::vector<Outline>>{{below, above}, {}}) {
    const auto found = reconcile(shelf.map({}), shelf.map(gone, 0, 9), booked, shelf.fiducials, {}, &wood);
    ASSERT_TRUE(found.ok()) << found.error().message;
    const double left = gone.empty() ? 3 * 180 : 180;
    EXPECT_NEAR(area_told(found->differences, DifferenceKind::kBookedNotGone), left, 0.15 * left)
        << told(found->differences);
  }
}

TEST(Reconcile, SaysThatTheLightIsNoLamps) {
  const Shelf shelf;
  const auto before = shelf.map({});
  auto now = shelf.map({}, 0.04, 9);
  const auto sound = reconcile(before, now, {}, shelf.fiducials);
  ASSERT_TRUE(sound.ok()) << sound.error().message;
  EXPECT_TRUE(sound->light_known);
  now.pixels *= 0.3;
  const auto dark = reconcile(before, now, {}, shelf.fiducials);
  ASSERT_TRUE(dark.ok()) << dark.error().message;
  EXPECT_FALSE(dark->light_known);
}

// All of the sheet but this much of its lower left corner is in doubt.
Region<PanelFrame> all_but_a_corner(const Shelf& shelf, double side_mm) {
  const double x = shelf.panel.width, y = shelf.panel.height;
  return region_of({{side_mm, 0}, {x, 0}, {x, y}, {0, y}, {0, side_mm}, {side_mm, side_mm}});
}

TEST(Reconcile, WhatIsLearntOfACornerIsNotExtrapolated) {
  const Shelf shelf;
  const auto before = shelf.map({});
  for (const double side : {3.5, 4.0, 6.0, 10.0, 14.0}) {
    auto now = shelf.map({}, 0.04, 9);
    now.pixels *= 0.95;
    calib::ReconcileOptions options;
    options.uncertain = {all_but_a_corner(shelf, side)};
    const auto found = reconcile(before, now, {}, shelf.fiducials, options);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_TRUE(found->light_known) << side;
    for (const Outline& piece : {kLight, kDark, kBetween})
      EXPECT_LT(calib::share_gone(found->gone_mask, region_of(piece), 0.5_mm), 0.05) << side;
  }
}

// A sheet longer than what is judged at once: of its right half nothing is learnt, or all.
TEST(Reconcile, PartsOfALargeSheetAreSeenInTheLightOfAllOfIt) {
  Shelf shelf;
  shelf.panel = rendered::sample_panel(430, 70, 8);
  const auto before = shelf.map({});
  for (const bool in_doubt : {true, false}) {
    auto now = shelf.map({}, 0.04, 9);
    for (int c = 0; c < now.pixels.cols; ++c) now.pixels.col(c) *= in_doubt ? 0.95 : 0.85 + 0.15 * c / now.pixels.cols;
    calib::ReconcileOptions options;
    if (in_doubt) options.uncertain = regions_of({{{195, 0}, {430, 0}, {430, 70}, {195, 70}}});
    const auto found = calib::reconcile(before, now, {}, {}, options);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_TRUE(found->light_known);
    EXPECT_LT(calib::share_gone(found->gone_mask, region_of({{0, 0}, {430, 0}, {430, 70}, {0, 70}}), 1_mm), 0.01)
        << (in_doubt ? "in doubt" : "all over");
  }
}

TEST(Reconcile, WhereAllIsInDoubtTheLightIsNotKnown) {
  const Shelf shelf;
  calib::ReconcileOptions options;
  options.uncertain = {all_but_a_corner(shelf, -1)};
  const auto found = reconcile(shelf.map({}), shelf.map({}, 0.04, 9), {}, shelf.fiducials, options);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->light_known);
}

// A sheet of one tone says nothing of how the light's change goes with the tone.
TEST(Reconcile, TheLightOfABareSheetOfOneToneIsKnown) {
  const Shelf shelf;
  auto before = shelf.map({}), now = shelf.map({});
  cv::RNG random(7);
  for (cv::Mat* pixels : {&before.pixels, &now.pixels}) {
    *pixels = cv::Scalar(190, 190, 190);
    cv::Mat noise(pixels->size(), CV_16SC3);
    random.fill(noise, cv::RNG::NORMAL, cv::Scalar::all(0), cv::Scalar::all(3));
    cv::add(*pixels, noise, *pixels, cv::noArray(), CV_8U);
  }
  const auto found = calib::reconcile(before, now, {}, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->light_known);
  EXPECT_TRUE(found->differences.empty()) << told(found->differences);
}

TEST(Reconcile, RefusesMapsThatDoNotCoverTheSameArea) {
  const Shelf shelf;
  const auto map = shelf.map({});
  auto moved = map;
  moved.origin.x += Millimetres(1);
  EXPECT_FALSE(reconcile(map, moved, {}, shelf.fiducials).ok());
  moved.pixels = cv::Mat();
  EXPECT_FALSE(reconcile(map, moved, {}, shelf.fiducials).ok());
}

}  // namespace
}  // namespace veneer
