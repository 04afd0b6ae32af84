#include "planner/matching/free_wood.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "base/frames.h"
#include "planner/matching/banded_polygon.h"
#include "planner/matching/clearance.h"
#include "planner/poses/footprint.h"
#include "tests/support/patch_shapes.h"

namespace veneer::planner {
namespace {

Raster<PanelFrame> free_raster(int columns, int rows) {
  Raster<PanelFrame> raster;
  raster.pixels = cv::Mat(rows, columns, CV_8UC1, cv::Scalar(255));
  raster.resolution = {1};
  return raster;
}

Ring<PanelFrame> square(double x, double y, double side, Radians turn = Radians(0)) {
  const Isometry2<PanelFrame, PanelFrame> place(turn, point<PanelFrame>(x, y));
  const double h = side / 2;
  return place * Ring<PanelFrame>{point<PanelFrame>(-h, -h), point<PanelFrame>(h, -h), point<PanelFrame>(h, h),
                                  point<PanelFrame>(-h, h)};
}

TEST(FreeWood, KeepsTheKerfFromTheBorderAndFromBlockedPixels) {
  Raster<PanelFrame> raster = free_raster(100, 50);
  raster.pixels.at<std::uint8_t>(49 - 20, 70) = 0;  // the square from (70, 20) to (71, 21) mm
  const FreeWood wood(raster, 0.5_mm, 0_mm);
  EXPECT_TRUE(wood.admits(square(5.51, 5.51, 10)));
  EXPECT_FALSE(wood.admits(square(5.49, 5.51, 10)));
  EXPECT_TRUE(wood.admits(square(70 - 5.51, 20, 10)));
  EXPECT_FALSE(wood.admits(square(70 - 5.49, 20, 10)));
  EXPECT_TRUE(wood.admits(square(71 + 5.51, 20, 10)));
  EXPECT_FALSE(wood.admits(square(71 + 5.49, 20, 10)));
}

TEST(FreeWood, TheMarginCountsTowardsBlockedWoodButNotBetweenPieces) {
  FreeWood wood(free_raster(100, 50), 0.5_mm, 0.2_mm);
  EXPECT_FALSE(wood.admits(square(5.6, 20, 10)));
  EXPECT_TRUE(wood.admits(square(5.8, 20, 10)));
  wood.allocate(square(5.8, 20, 10));
  EXPECT_TRUE(wood.admits(square(5.8 + 11.01, 20, 10)));
}

TEST(FreeWood, OutlinesStayTwiceTheKerfApart) {
  FreeWood wood(free_raster(100, 50), 0.5_mm, 0_mm);
  wood.allocate(square(40, 25, 10));
  EXPECT_FALSE(wood.admits(square(50.99, 25, 10)));
  EXPECT_TRUE(wood.admits(square(51.01, 25, 10)));
  const double diagonal = 5 + 0.5 + (5 + 0.5) * std::sqrt(2.0);
  EXPECT_FALSE(wood.admits(square(40 + diagonal - 0.01, 25, 10, degrees(45))));
  EXPECT_TRUE(wood.admits(square(40 + diagonal + 0.01, 25, 10, degrees(45))));
}

// How something lies on a sheet of 60 x 40 mm.
struct Lie {
  double x, y, side;
  Radians turn;
};
Lie any_lie(int largest) {
  return {*rc::gen::inRange(0, 60000) / 1000.0, *rc::gen::inRange(0, 40000) / 1000.0,
          *rc::gen::inRange(3000, 1000 * largest) / 1000.0, degrees(*rc::gen::inRange(0, 360))};
}

RC_GTEST_PROP(FreeWood, WhatItAdmitsTheLedgersPolygonsAdmitToo, ()) {
  const Millimetres kerf(*rc::gen::inRange(0, 60) / 100.0);
  FreeWood wood(free_raster(60, 40), kerf, 0_mm);
  std::vector<Region<PanelFrame>> booked;
  const Region<PanelFrame> sheet(Ring<PanelFrame>{point<PanelFrame>(0, 0), point<PanelFrame>(60, 0),
                                                  point<PanelFrame>(60, 40), point<PanelFrame>(0, 40)});
  for (int i = 0; i < 40; ++i) {
    const Lie lie = any_lie(9);
    const auto outline = square(lie.x, lie.y, lie.side, lie.turn);
    if (!wood.admits(outline)) continue;
    wood.allocate(outline);
    const Region<PanelFrame> allocation = offset(Region<PanelFrame>(outline), kerf);
    RC_ASSERT(subtract(allocation, sheet).area().count() == 0.0);
    for (const auto& other : booked) RC_ASSERT(intersect(allocation, other).area().count() == 0.0);
    booked.push_back(allocation);
  }
}

Ring<PanelFrame> laid(const test::Shape& shape, const Lie& lie) {
  Ring<PanelFrame> upright;
  for (const auto& [u, v] : shape) upright.push_back(point<PanelFrame>(lie.side * (u - 0.5), lie.side * (v - 0.5)));
  return Isometry2<PanelFrame, PanelFrame>(lie.turn, point<PanelFrame>(lie.x, lie.y)) * upright;
}

// Shapes of all kinds side by side, judged by the ledger's polygons in both directions.
RC_GTEST_PROP(FreeWood, DecidesAsTheLedgersPolygonsDoForAnyShape, ()) {
  constexpr double kRounding = 0.012;  // mm: kSlack, and what micrometres move a corner by
  const Millimetres kerf(*rc::gen::inRange(2, 40) / 100.0);
  Raster<PanelFrame> raster = free_raster(60, 40);
  std::vector<Region<PanelFrame>> taken;
  for (int i = 0; i < 12; ++i) {
    const int column = *rc::gen::inRange(0, 60), row = *rc::gen::inRange(0, 40);
    raster.pixels.at<std::uint8_t>(row, column) = 0;
    taken.emplace_back(square(column + 0.5, 39.5 - row, 1));
  }
  // Beyond the sheet nothing is free.
  taken.emplace_back(square(-50, 20, 100)), taken.emplace_back(square(110, 20, 100));
  taken.emplace_back(square(30, -50, 100)), taken.emplace_back(square(30, 90, 100));
  FreeWood wood(raster, kerf, 0_mm);
  for (int i = 0; i < 30; ++i) {
    const auto number = *rc::gen::inRange<std::size_t>(0, 1000);
    const test::Shape shape = number % 5 == 0   ? test::ell(number)
                              : number % 5 == 1 ? test::crescent(number)
                              : number % 5 == 2 ? test::meander(number)
                              : number % 5 == 3 ? test::triangle(number)
                                                : test::star(number);
    const auto outline = laid(shape, any_lie(15));
    const bool admitted = wood.admits(outline);
    const Region<PanelFrame> allocation = offset(Region<PanelFrame>(outline), kerf);
    const Region<PanelFrame> wider = offset(Region<PanelFrame>(outline), kerf + Millimetres(kRounding));
    bool clear = true, clear_of_wider = true;
    for (const auto& other : taken) {
      clear = clear && intersect(allocation, other).area().count() == 0.0;
      clear_of_wider = clear_of_wider && intersect(wider, other).area().count() == 0.0;
    }
    RC_ASSERT(clear || !admitted);
    // Convex outlines keep all of their pointed corners free.
    if (!is_convex(outline)) RC_ASSERT(admitted || !clear_of_wider);
    if (!admitted) continue;
    wood.allocate(outline);
    taken.push_back(allocation);
  }
}

// As a plan is kept: what was admitted is asked for again, in another order.
RC_GTEST_PROP(FreeWood, AdmitsAgainWhatItAdmittedInAnyOrder, ()) {
  const Millimetres kerf(*rc::gen::inRange(2, 40) / 100.0);
  FreeWood wood(free_raster(60, 40), kerf, 0_mm);
  std::vector<Ring<PanelFrame>> admitted;
  for (int i = 0; i < 60; ++i) {
    const auto number = *rc::gen::inRange<std::size_t>(0, 1000);
    const auto outline = laid(number % 2 == 0 ? test::ell(number) : test::crescent(number), any_lie(9));
    if (!wood.admits(outline)) continue;
    wood.allocate(outline);
    admitted.push_back(outline);
  }
  FreeWood again(free_raster(60, 40), kerf, 0_mm);
  for (auto it = admitted.rbegin(); it != admitted.rend(); ++it) {
    RC_ASSERT(again.admits_again(*it));
    again.allocate(*it);
    RC_ASSERT(!again.admits_again(*it));
  }
}

// A place that needs the slack between neighbours one way round, and has it the other way round.
TEST(FreeWood, AsksForNoSlackOnceMore) {
  FreeWood wood(free_raster(100, 50), 0.5_mm, 0_mm);
  const test::Shape shape{{0, 0}, {1, 0}, {1, 0.4}, {0.4, 0.4}, {0.4, 1}, {0, 1}};
  wood.allocate(laid(shape, {30, 25, 10, degrees(0)}));
  const auto close = laid(shape, {30 + 11.002, 25, 10, degrees(0)});
  EXPECT_FALSE(wood.admits(close));
  EXPECT_TRUE(wood.admits_again(close));
  EXPECT_FALSE(wood.admits_again(laid(shape, {30 + 10.99, 25, 10, degrees(0)})));
}

TEST(FreeWood, GrantsTwoLsInOneAnothersNotch) {
  FreeWood wood(free_raster(100, 50), 0.5_mm, 0_mm);
  // Arms of 4 mm and notches of 6: each has an arm in the other's.
  const test::Shape shape{{0, 0}, {1, 0}, {1, 0.4}, {0.4, 0.4}, {0.4, 1}, {0, 1}};
  ASSERT_TRUE(wood.admits(laid(shape, {30, 25, 10, degrees(0)})));
  wood.allocate(laid(shape, {30, 25, 10, degrees(0)}));
  EXPECT_FALSE(wood.admits(laid(shape, {30 - 1.01, 25 + 5.02, 10, degrees(180)}))) << "less than twice the kerf apart";
  EXPECT_TRUE(wood.admits(laid(shape, {30 - 0.98, 25 + 5.02, 10, degrees(180)})));
  EXPECT_FALSE(wood.admits(laid(shape, {30 - 0.98, 25 + 4.99, 10, degrees(180)})));
  // A small square in the notch, and a blocked pixel there that harms nobody.
  EXPECT_TRUE(wood.admits(square(32.51, 27.51, 4.9)));
  Raster<PanelFrame> holed = free_raster(100, 50);
  holed.pixels.at<std::uint8_t>(49 - 27, 32) = 0;
  EXPECT_TRUE(FreeWood(holed, 0.5_mm, 0_mm).admits(laid(shape, {30, 25, 10, degrees(0)})));
  holed.pixels.at<std::uint8_t>(49 - 21, 32) = 0;
  EXPECT_FALSE(FreeWood(holed, 0.5_mm, 0_mm).admits(laid(shape, {30, 25, 10, degrees(0)})));
}

TEST(FreeWood, ANotchThatGrowthClosesLeavesItsMiddleToOthers) {
  FreeWood wood(free_raster(60, 60), 0.5_mm, 0_mm);
  // A C of 20 mm with a mouth of 0.8 mm and a room of 12 x 12 mm.
  const test::Shape shape{{0, 0},     {1, 0},     {1, 0.48},   {0.8, 0.48}, {0.8, 0.2}, {0.2, 0.2},
                          {0.2, 0.8}, {0.8, 0.8}, {0.8, 0.52}, {1, 0.52},   {1, 1},     {0, 1}};
  wood.allocate(laid(shape, {30, 30, 20, degrees(0)}));
  EXPECT_TRUE(wood.admits(square(30, 30, 9.98)));
  EXPECT_FALSE(wood.admits(square(30, 30, 10.02)));
}

// Notches and all: footprints that are apart are never refused, whichever comes first.
RC_GTEST_PROP(Footprint, OfConcaveOutlinesAreNeverTooSmall, ()) {
  const Millimetres kerf(*rc::gen::inRange(0, 100) / 100.0);
  const auto outline = [](std::size_t number) {
    Ring<ArtworkFrame> out;
    for (const auto& [x, y] : number % 3 == 0   ? test::ell(number)
                              : number % 3 == 1 ? test::crescent(number)
                                                : test::star(number))
      out.push_back(point<ArtworkFrame>(3 + 8 * x, 5 + 8 * y));
    return out;
  };
  const auto a = outline(*rc::gen::inRange<std::size_t>(0, 1000)), b = outline(*rc::gen::inRange<std::size_t>(0, 1000));
  const auto number = [](int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; };
  const double turn_a = number(0, 7), x = number(18, 42), y = number(18, 42), turn_b = number(0, 7);
  const Pose at_a = pose_at(0, 30, 30, turn_a), at_b = pose_at(0, x, y, turn_b);
  const Footprint fa(a, kerf + FreeWood::kSlack), fb(b, kerf + FreeWood::kSlack);
  FreeWood wood(free_raster(60, 60), kerf, 0_mm);
  wood.allocate(fa.panel_from_artwork(at_a) * a);
  if (!Footprint::overlap(fa, at_a, fb, at_b)) RC_ASSERT(!wood.collides(fb.panel_from_artwork(at_b) * b));
}

// What discs rule out, FreeWood refuses; and they rule out most of what it refuses.
RC_GTEST_PROP(Clearance, RulesOutOnlyWhatFreeWoodRefuses, ()) {
  const auto seed = *rc::gen::inRange<std::size_t>(0, 100000);
  const Millimetres kerf(*rc::gen::inRange(0, 60) / 100.0);
  Raster<PanelFrame> raster = free_raster(70, 60);
  cv::RNG random(seed);
  for (int i = 0; i < 20; ++i) {
    const cv::Point blocked{random.uniform(0, 70), random.uniform(0, 60)};
    raster.pixels.at<std::uint8_t>(blocked) = 0;
  }
  FreeWood wood(raster, kerf, 0_mm);
  // Features at twice the stock's resolution.
  Raster<PanelFrame> picture;
  picture.pixels = cv::Mat(120, 140, CV_32FC1, cv::Scalar(0));
  picture.resolution = {2};
  const test::Shape shape = seed % 3 == 0 ? test::ell(seed) : seed % 3 == 1 ? test::star(seed) : test::crescent(seed);
  Ring<ArtworkFrame> outline;
  for (const auto& [x, y] : shape) outline.push_back(point<ArtworkFrame>(2 + 12 * x, 2 + 12 * y));
  const PixelGrid grid{{2}, 16_mm};
  const PatchPixels pixels = patch_pixels(outline, grid, 32, 32);
  Clearance clearance = *Clearance::measure(wood, 6_mm + kerf, {});
  const Lattice lattice(140, 120, degrees(random.uniform(0, 360)));
  const Cover cover(cover_of(outline, grid, pixels.left, pixels.top), lattice, picture, clearance);
  int refused = 0, ruled_out = 0;
  for (int i = 0; i < 300; ++i) {
    const int x = random.uniform(0, lattice.width()), y = random.uniform(0, lattice.height());
    const auto at = panel_from_artwork(lattice, picture, grid, pixels.left, pixels.top, x, y) * outline;
    const bool admitted = wood.admits(at);
    RC_ASSERT(!admitted || !cover.rules_out(x, y, 0));
    if (cover.rules_out(x, y, 1.5))
      for (const auto& [dx, dy] : {std::pair(-1, -1), {1, 0}, {1, 1}, {0, 1}})
        RC_ASSERT(!wood.admits(panel_from_artwork(lattice, picture, grid, pixels.left, pixels.top, x + dx, y + dy) *
                               outline));
    refused += admitted ? 0 : 1, ruled_out += cover.rules_out(x, y, 0) ? 1 : 0;
    if (!admitted || i % 4 != 0) continue;
    wood.allocate(at);
    clearance.take(grown_rings(at, kerf));
    // What asks first and coarsely is never the stricter one.
    for (int k = 0; k < 40; ++k) {
      const double column = random.uniform(-3.0, 73.0), row = random.uniform(-3.0, 63.0),
                   exact = clearance.at(column, row);
      RC_ASSERT(clearance.at_most(column, row) >= exact);
    }
  }
  RC_ASSERT(ruled_out > refused * 0.6);
}

TEST(ConvexOverlap, TouchingIsNoOverlap) {
  EXPECT_FALSE(convex_overlap(square(0, 0, 2), square(2, 0, 2)));
  EXPECT_TRUE(convex_overlap(square(0, 0, 2), square(1.999, 0, 2)));
  EXPECT_TRUE(convex_overlap(square(0, 0, 10), square(1, 1, 1, degrees(30))));
}

}  // namespace
}  // namespace veneer::planner
