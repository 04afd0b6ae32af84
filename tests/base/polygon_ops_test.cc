#include "base/polygon_ops.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace veneer {
namespace {

Region<PanelFrame> rectangle(double x, double y, double width, double height) {
  return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, y), point<PanelFrame>(x + width, y),
                                             point<PanelFrame>(x + width, y + height),
                                             point<PanelFrame>(x, y + height)});
}

double mm2(const Region<PanelFrame>& region) { return region.area().count(); }

Point<PanelFrame> any_point() {
  const double x = *rc::gen::inRange(0, 40000) / 1000.0, y = *rc::gen::inRange(0, 40000) / 1000.0;
  return point<PanelFrame>(x, y);
}

// A triangle or quadrilateral anywhere within 40 mm, self-crossing ones included.
Region<PanelFrame> any_region() {
  Ring<PanelFrame> ring;
  for (int i = 0, n = *rc::gen::inRange(3, 6); i < n; ++i) ring.push_back(any_point());
  return Region<PanelFrame>(ring);
}

bool on_border(const Region<PanelFrame>& region, const Point<PanelFrame>& p) {
  const Region<PanelFrame> near = rectangle(p.x.count() - 0.004, p.y.count() - 0.004, 0.008, 0.008);
  const double shared = mm2(intersect(region, near));
  return shared > 0 && shared < mm2(near);
}

TEST(PolygonOps, EitherDirectionOfARingMakesTheSameRegion) {
  const Ring<PanelFrame> forward = {point<PanelFrame>(0, 0), point<PanelFrame>(4, 0), point<PanelFrame>(0, 3)};
  const Ring<PanelFrame> backward(forward.rbegin(), forward.rend());
  EXPECT_DOUBLE_EQ(mm2(Region<PanelFrame>(forward)), 6);
  EXPECT_DOUBLE_EQ(mm2(Region<PanelFrame>(backward)), 6);
  EXPECT_GT(signed_area(Region<PanelFrame>(backward).rings()[0]), 0);
}

TEST(PolygonOps, CoordinatesAreWholeMicrometres) {
  const auto region = rectangle(0.0004, 0.0006, 1, 1);
  EXPECT_DOUBLE_EQ(mm2(region), 1);
  EXPECT_TRUE(region.contains(point<PanelFrame>(0, 0.001)));
}

TEST(PolygonOps, AHoleRunsClockwiseAndIsNotInside) {
  const auto frame = subtract(rectangle(0, 0, 10, 10), rectangle(3, 3, 4, 4));
  EXPECT_DOUBLE_EQ(mm2(frame), 84);
  ASSERT_EQ(frame.rings().size(), 2U);
  EXPECT_LT(signed_area(frame.rings()[0]) * signed_area(frame.rings()[1]), 0);
  EXPECT_FALSE(frame.contains(point<PanelFrame>(5, 5)));
  EXPECT_TRUE(frame.contains(point<PanelFrame>(1, 1)));
  EXPECT_TRUE(frame.contains(point<PanelFrame>(3, 5))) << "a border counts as inside";
}

TEST(PolygonOps, TouchingIsNotOverlapping) {
  EXPECT_FALSE(overlaps(rectangle(0, 0, 10, 10), rectangle(10, 0, 10, 10)));
  EXPECT_FALSE(overlaps(rectangle(0, 0, 10, 10), rectangle(10, 10, 10, 10)));
  EXPECT_TRUE(overlaps(rectangle(0, 0, 10, 10), rectangle(9.999, 0, 10, 10)));
  EXPECT_TRUE(overlaps(rectangle(0, 0, 10, 10), rectangle(2, 2, 1, 1)));
}

// A panel has a hundred thousand allocations, and nearly all of them lie elsewhere.
TEST(PolygonOps, WhatLiesElsewhereIsToldByItsBox) {
  const auto boxes_overlap = [](const auto& a, const auto& b) {
    return micro::boxes_overlap(a.micro_area(), b.micro_area());
  };
  const auto square = rectangle(0, 0, 10, 10), nothing = Region<PanelFrame>();
  EXPECT_FALSE(boxes_overlap(square, rectangle(10, 0, 10, 10)));
  EXPECT_FALSE(boxes_overlap(square, rectangle(0, -10, 10, 10)));
  EXPECT_TRUE(boxes_overlap(square, rectangle(9.999, 9.999, 10, 10)));
  EXPECT_TRUE(boxes_overlap(square, rectangle(2, 2, 1, 1)));
  EXPECT_FALSE(boxes_overlap(square, nothing));
  EXPECT_FALSE(boxes_overlap(nothing, nothing));
  EXPECT_FALSE(overlaps(square, nothing));
  const auto apart = unite(rectangle(-20, 0, 5, 5), rectangle(20, 2, 5, 5));
  EXPECT_TRUE(boxes_overlap(square, apart)) << "its box says so";
  EXPECT_FALSE(overlaps(square, apart)) << "and the shapes do not";
  EXPECT_EQ(apart.box().min.x, -20_mm);
  EXPECT_EQ(apart.box().max.y, 7_mm);
}

TEST(PolygonOps, AMitredOffsetOfASquareIsASquare) {
  EXPECT_DOUBLE_EQ(mm2(offset(rectangle(0, 0, 10, 10), 0.3_mm)), 10.6 * 10.6);
  EXPECT_DOUBLE_EQ(mm2(offset(rectangle(0, 0, 10, 10), -0.3_mm)), 9.4 * 9.4);
}

TEST(PolygonOps, ARoundOffsetAddsArcsWithinFiveMicrometres) {
  const double grown = mm2(offset(rectangle(0, 0, 10, 10), 1_mm, Corners::kRound));
  const double exact = 100 + 40 + kPi;
  EXPECT_LE(grown, exact + 1e-6);
  EXPECT_GT(grown, exact - 2 * kPi * 0.005);
}

TEST(PolygonOps, ShrinkingPastNothingIsEmpty) {
  EXPECT_TRUE(offset(rectangle(0, 0, 1, 10), -0.5_mm).empty());
  EXPECT_TRUE(Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(0, 0), point<PanelFrame>(9, 0)}).empty());
}

TEST(PolygonOps, UnitingManyCountsOverlapsOnce) {
  EXPECT_DOUBLE_EQ(mm2(unite(std::vector{rectangle(0, 0, 10, 10), rectangle(5, 0, 10, 10), rectangle(0, 0, 10, 10)})),
                   150);
  const auto frame = subtract(rectangle(0, 0, 10, 10), rectangle(3, 3, 4, 4));
  EXPECT_DOUBLE_EQ(mm2(unite(std::vector{frame, rectangle(4, 4, 1, 1)})), 85);
}

RC_GTEST_PROP(PolygonOps, AreasOfUnionAndIntersectionAddUp, ()) {
  const auto a = any_region(), b = any_region();
  // Crossing points are rounded to whole micrometres: about 1 um along up to 200 mm of border.
  RC_ASSERT(std::abs(mm2(unite(a, b)) + mm2(intersect(a, b)) - mm2(a) - mm2(b)) < 0.5);
  RC_ASSERT(std::abs(mm2(subtract(a, b)) + mm2(intersect(a, b)) - mm2(a)) < 0.5);
}

RC_GTEST_PROP(PolygonOps, OperationsAgreeWithPointMembership, ()) {
  const auto a = any_region(), b = any_region();
  const auto p = any_point();
  if (on_border(a, p) || on_border(b, p)) return;
  const bool in_a = a.contains(p), in_b = b.contains(p);
  RC_ASSERT(unite(a, b).contains(p) == (in_a || in_b));
  RC_ASSERT(intersect(a, b).contains(p) == (in_a && in_b));
  RC_ASSERT(subtract(a, b).contains(p) == (in_a && !in_b));
}

// An L: both ends of a path may lie in it while the way between them leaves it.
TEST(PolygonOps, APathIsInsideOnlyWithAllItsWay) {
  const Region<PanelFrame> corner(Ring<PanelFrame>{point<PanelFrame>(0, 0), point<PanelFrame>(10, 0),
                                                   point<PanelFrame>(10, 2), point<PanelFrame>(2, 2),
                                                   point<PanelFrame>(2, 10), point<PanelFrame>(0, 10)});
  const auto right = point<PanelFrame>(9, 1), inner = point<PanelFrame>(1, 1), top = point<PanelFrame>(1, 9);
  using Path = Polyline<PanelFrame>;
  EXPECT_TRUE(corner.contains(Path{right, inner, top}));
  EXPECT_FALSE(corner.contains(Path{right, top}));
  EXPECT_FALSE(corner.contains(Path{right, inner, top, right})) << "nor where it comes back";
  EXPECT_FALSE(corner.contains(Path{point<PanelFrame>(11, 1), point<PanelFrame>(12, 1)})) << "wholly outside";
  EXPECT_TRUE(corner.contains(Path{inner})) << "a path of one point is that point";
  EXPECT_TRUE(corner.contains(Path{inner, inner}));
  EXPECT_FALSE(corner.contains(Path{point<PanelFrame>(5, 5), point<PanelFrame>(5, 5)}));
  EXPECT_TRUE(corner.contains(Path{}));
  EXPECT_FALSE(Region<PanelFrame>().contains(Path{right, inner}));
}

RC_GTEST_PROP(PolygonOps, GrowingHoldsAndShrinkingIsHeld, ()) {
  const auto region = any_region();
  RC_ASSERT(mm2(subtract(region, offset(region, 0.3_mm))) < 1e-3);
  RC_ASSERT(mm2(subtract(offset(region, -0.3_mm), region)) < 1e-3);
}

RC_GTEST_PROP(PolygonOps, EqualInputsGiveEqualOutputs, ()) {
  const auto a = any_region(), b = any_region();
  RC_ASSERT(unite(a, b).micro_area().rings == unite(a, b).micro_area().rings);
  RC_ASSERT(offset(a, 0.3_mm).micro_area().rings == offset(a, 0.3_mm).micro_area().rings);
}

RC_GTEST_PROP(PolygonOps, OverlapIsSymmetricAndNothingOverlapsWhatWasSubtracted, ()) {
  const auto a = any_region(), b = any_region();
  RC_ASSERT(overlaps(a, b) == overlaps(b, a));
  RC_ASSERT(overlaps(a, b) == (mm2(intersect(a, b)) > 1e-4));
  RC_ASSERT(!overlaps(subtract(a, b), b, SquareMillimetres(0.2)));
}

}  // namespace
}  // namespace veneer
