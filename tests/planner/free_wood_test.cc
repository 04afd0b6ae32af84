#include "planner/matching/free_wood.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "base/frames.h"

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

RC_GTEST_PROP(FreeWood, WhatItAdmitsTheLedgersPolygonsAdmitToo, ()) {
  const Millimetres kerf(*rc::gen::inRange(0, 60) / 100.0);
  FreeWood wood(free_raster(60, 40), kerf, 0_mm);
  std::vector<Region<PanelFrame>> booked;
  const Region<PanelFrame> sheet(Ring<PanelFrame>{point<PanelFrame>(0, 0), point<PanelFrame>(60, 0),
                                                  point<PanelFrame>(60, 40), point<PanelFrame>(0, 40)});
  for (int i = 0; i < 40; ++i) {
    const auto outline = square(*rc::gen::inRange(0, 60000) / 1000.0, *rc::gen::inRange(0, 40000) / 1000.0,
                                *rc::gen::inRange(3000, 9000) / 1000.0, degrees(*rc::gen::inRange(0, 360)));
    if (!wood.admits(outline)) continue;
    wood.allocate(outline);
    const Region<PanelFrame> allocation = offset(Region<PanelFrame>(outline), kerf);
    RC_ASSERT(subtract(allocation, sheet).area().count() == 0.0);
    for (const auto& other : booked) RC_ASSERT(intersect(allocation, other).area().count() == 0.0);
    booked.push_back(allocation);
  }
}

TEST(ConvexOverlap, TouchingIsNoOverlap) {
  EXPECT_FALSE(convex_overlap(square(0, 0, 2), square(2, 0, 2)));
  EXPECT_TRUE(convex_overlap(square(0, 0, 2), square(1.999, 0, 2)));
  EXPECT_TRUE(convex_overlap(square(0, 0, 10), square(1, 1, 1, degrees(30))));
}

}  // namespace
}  // namespace veneer::planner
