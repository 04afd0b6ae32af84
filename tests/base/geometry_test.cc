#include "base/geometry.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace veneer {
namespace {

const Ring<PanelFrame> kTriangle = {point<PanelFrame>(0, 0), point<PanelFrame>(4, 0), point<PanelFrame>(0, 3)};

TEST(Geometry, AreaIsPositiveCounterClockwise) {
  EXPECT_DOUBLE_EQ(signed_area(kTriangle), 6);
  auto turned = kTriangle;
  std::reverse(turned.begin(), turned.end());
  EXPECT_DOUBLE_EQ(signed_area(turned), -6);
}

TEST(Geometry, DistanceHasTheUnitOfItsFrame) {
  EXPECT_EQ(distance(kTriangle[1], kTriangle[2]), 5_mm);
  EXPECT_EQ(distance(point<ScanFrame>(1, 1), point<ScanFrame>(4, 5)), 5_px);
}

TEST(Geometry, AnEmptyBoxHoldsNothingAndGrowsToItsPoints) {
  Box<PanelFrame> box;
  EXPECT_TRUE(box.empty());
  EXPECT_FALSE(box.contains(point<PanelFrame>(0, 0)));
  box = bounds(kTriangle);
  EXPECT_FALSE(box.empty());
  EXPECT_EQ(box.width(), 4_mm);
  EXPECT_EQ(box.height(), 3_mm);
  EXPECT_TRUE(box.contains(point<PanelFrame>(4, 3)));
  EXPECT_FALSE(box.contains(point<PanelFrame>(4.001, 3)));
}

TEST(Geometry, ABoxOfOnePointIsNotEmpty) { EXPECT_FALSE(bounds(std::vector{point<PanelFrame>(1, 2)}).empty()); }

}  // namespace
}  // namespace veneer
