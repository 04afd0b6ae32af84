// What a brush covers.
#include "daemon/services/brush.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace veneer::daemon {
namespace {

// Of a regular polygon of sixteen corners.
double round_area(double radius) { return 8 * radius * radius * std::sin(std::numbers::pi / 8); }

TEST(Brush, ADabIsARound) {
  const auto dab = brushed({{point<PanelFrame>(10, 10)}}, 4_mm);
  EXPECT_NEAR(dab.area().count(), round_area(2), 0.02);
  EXPECT_TRUE(dab.contains(point<PanelFrame>(11.9, 10)));
  EXPECT_FALSE(dab.contains(point<PanelFrame>(12.1, 10)));
}

TEST(Brush, AStrokeIsAsWideAsTheBrushAndRoundAtItsEnds) {
  const auto stroke = brushed({{point<PanelFrame>(0, 0), point<PanelFrame>(6, 8)}}, 4_mm);
  EXPECT_NEAR(stroke.area().count(), 10 * 4 + round_area(2), 0.05);
}

TEST(Brush, WhatIsDrawnOverTwiceCountsOnceAndALoopKeepsItsHole) {
  const std::vector<Point<PanelFrame>> there_and_back = {point<PanelFrame>(0, 0), point<PanelFrame>(10, 0),
                                                         point<PanelFrame>(0, 0)};
  EXPECT_NEAR(brushed({there_and_back, there_and_back}, 4_mm).area().count(), 40 + round_area(2), 0.05);
  const auto loop = brushed({{point<PanelFrame>(0, 0), point<PanelFrame>(30, 0), point<PanelFrame>(30, 30),
                              point<PanelFrame>(0, 30), point<PanelFrame>(0, 0)}},
                            4_mm);
  EXPECT_FALSE(loop.contains(point<PanelFrame>(15, 15)));
  EXPECT_TRUE(loop.contains(point<PanelFrame>(15, 1)));
}

TEST(Brush, NothingDrawnIsNothing) { EXPECT_TRUE(brushed({}, 4_mm).empty()); }

}  // namespace
}  // namespace veneer::daemon
