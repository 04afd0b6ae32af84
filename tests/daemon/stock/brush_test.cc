// What a brush covers: never less than was painted where wood is withheld, never more where it is given, and never more
// work than a moment's.
#include "daemon/stock/brush.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "daemon/api/route_table.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

constexpr double kMostOver = 0.15;  // mm, as brush.h says

Point<PanelFrame> at(double x, double y) { return point<PanelFrame>(x, y); }

double distance_to(const BrushStroke& stroke, const Point<PanelFrame>& p) {
  double least = 1e9;
  for (std::size_t i = 0; i < stroke.size(); ++i) {
    const auto &a = stroke[i > 0 ? i - 1 : 0], &b = stroke[i];
    const double x = (b.x - a.x).count(), y = (b.y - a.y).count();
    const double px = (p.x - a.x).count(), py = (p.y - a.y).count();
    const double along = x * x + y * y > 0 ? std::clamp((px * x + py * y) / (x * x + y * y), 0.0, 1.0) : 0;
    least = std::min(least, std::hypot(px - along * x, py - along * y));
  }
  return least;
}

double area_of(const std::vector<BrushStroke>& strokes, double width, BrushEdge edge) {
  const auto made = brushed(strokes, Millimetres(width), edge);
  return made ? made->area().count() : -1;
}

std::size_t corners(const Region<PanelFrame>& area) {
  std::size_t out = 0;
  for (const auto& ring : area.micro_area().rings) out += ring.size();
  return out;
}

RC_GTEST_PROP(Brush, WithholdsAllThatWasPaintedAndGivesNothingElse, ()) {
  const auto mm = [](int most) {
    return rc::gen::map(rc::gen::inRange(0, most * 100), [](int v) { return v / 100.0; });
  };
  const double width = 0.5 + *mm(59);
  BrushStroke stroke;
  const int points = *rc::gen::inRange(1, 30);
  for (int i = 0; i < points; ++i) {
    const double x = *mm(60), y = *mm(60);
    stroke.push_back(at(x, y));
  }
  const auto withheld = brushed({stroke}, Millimetres(width), BrushEdge::kOutwards);
  const auto given = brushed({stroke}, Millimetres(width), BrushEdge::kInwards);
  RC_ASSERT(withheld.ok());
  RC_ASSERT(given.ok());
  for (int i = 0; i < 60; ++i) {
    // About the brush's rim, where it is decided.
    const auto& from = stroke[static_cast<std::size_t>(*rc::gen::inRange(0, points))];
    const double angle = *rc::gen::inRange(0, 628) / 100.0, reach = width / 2 + *rc::gen::inRange(-300, 300) / 1000.0;
    const auto p = at(from.x.count() + reach * std::cos(angle), from.y.count() + reach * std::sin(angle));
    const double away = distance_to(stroke, p);
    if (away <= width / 2) RC_ASSERT(withheld->contains(p));
    if (away > width / 2 + kMostOver) RC_ASSERT(!withheld->contains(p));
    if (away > width / 2) RC_ASSERT(!given->contains(p));
    if (away < width / 2 - kMostOver) RC_ASSERT(given->contains(p));
  }
}

TEST(Brush, ADabIsRoundAndAStrokeAsWideAsTheBrush) {
  const double round = std::numbers::pi * 4, rim = 2 * std::numbers::pi * 2;
  EXPECT_GE(area_of({{at(10, 10)}}, 4, BrushEdge::kOutwards), round);
  EXPECT_LE(area_of({{at(10, 10)}}, 4, BrushEdge::kOutwards), round + kMostOver * rim + 0.1);
  EXPECT_LE(area_of({{at(10, 10)}}, 4, BrushEdge::kInwards), round);
  EXPECT_GE(area_of({{at(10, 10)}}, 4, BrushEdge::kInwards), round - kMostOver * rim);
  EXPECT_NEAR(area_of({{at(0, 0), at(6, 8)}}, 4, BrushEdge::kOutwards), 40 + round, kMostOver * (rim + 20) + 0.1);
}

TEST(Brush, WhatIsDrawnOverTwiceCountsOnceAndALoopKeepsItsHole) {
  const BrushStroke there_and_back = {at(0, 0), at(10, 0), at(0, 0)};
  EXPECT_NEAR(area_of({there_and_back, there_and_back}, 4, BrushEdge::kInwards),
              area_of({{at(0, 0), at(10, 0)}}, 4, BrushEdge::kInwards), 0.05);
  const auto loop = brushed({{at(0, 0), at(30, 0), at(30, 30), at(0, 30), at(0, 0)}}, 4_mm, BrushEdge::kOutwards);
  ASSERT_TRUE(loop.ok());
  EXPECT_FALSE(loop->contains(at(15, 15)));
  EXPECT_TRUE(loop->contains(at(15, 1)));
}

TEST(Brush, NothingDrawnIsNothing) {
  const auto none = brushed({}, 4_mm, BrushEdge::kOutwards);
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->empty());
}

// A finger's path has a point wherever the screen felt it.
TEST(Brush, APathOfManyPointsIsAsSimpleAsItsShape) {
  BrushStroke straight;
  for (int i = 0; i < 500; ++i) straight.push_back(at(i * 0.2, 0.02 * (i % 2)));
  const auto made = brushed({straight}, 8_mm, BrushEdge::kOutwards);
  ASSERT_TRUE(made.ok());
  EXPECT_LT(corners(*made), 60U);
}

// Narrow strokes to and fro and up and down: gaps by the square of their number. Each half on its own is taken.
TEST(Brush, WhatTakesTooLongIsRefusedInWords) {
  BrushStroke across, along;
  for (int i = 0; i < 120; ++i) {
    across.push_back(at(i % 2 * 1500, 8 * i));
    along.push_back(at(12 * i, i % 2 * 1000));
  }
  EXPECT_TRUE(brushed({across}, 2_mm, BrushEdge::kOutwards).ok());
  EXPECT_TRUE(brushed({along}, 2_mm, BrushEdge::kOutwards).ok());
  const auto crossed = brushed({across, along}, 2_mm, BrushEdge::kOutwards);
  ASSERT_FALSE(crossed.ok());
  EXPECT_EQ(crossed.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(crossed.error().message, HasSubstr("save fewer of them at once"));
  // The widest brush over and over the same place is one simple shape.
  BrushStroke scribble;
  for (int i = 0; i < 200; ++i) scribble.push_back(at(100 + 80 * std::sin(i * 1.7), 100 + 80 * std::cos(i * 2.3)));
  const auto one = brushed({scribble}, kWidestBrush, BrushEdge::kOutwards);
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_LT(corners(*one), 2000U) << "a few for each point along its rim";
}

TEST(Brush, HasItsBounds) {
  const std::vector<BrushStroke> dab = {{at(1, 1)}};
  EXPECT_FALSE(brushed({BrushStroke(kMostBrushPoints + 1, at(1, 1))}, 4_mm, BrushEdge::kInwards).ok());
  EXPECT_TRUE(brushed({BrushStroke(kMostBrushPoints, at(1, 1))}, 4_mm, BrushEdge::kInwards).ok());
  for (const double width : {0.0, 0.49, 60.1, -4.0, std::nan("")})
    EXPECT_FALSE(brushed(dab, Millimetres(width), BrushEdge::kInwards).ok()) << width;
  for (const double width : {0.5, 60.0})
    EXPECT_TRUE(brushed(dab, Millimetres(width), BrushEdge::kInwards).ok()) << width;
  EXPECT_EQ(Millimetres(ranges::kBrushWidth.least), kNarrowestBrush);
  EXPECT_EQ(Millimetres(ranges::kBrushWidth.most), kWidestBrush);
}

// With every digit that a number may have, as a client may write it.
TEST(Brush, AsManyPointsAndCornersAsMayBeFitIntoARequest) {
  const double longest = -1234.5678901234567;
  const nlohmann::json strokes = {{"kind", "withhold"},
                                  {"note", std::string(ranges::kLongestReason, '"')},
                                  {"version", 1'000'000},
                                  {"strokes_mm", std::vector<double>(2 * kMostBrushPoints, longest)},
                                  {"stroke_points", std::vector<double>(kMostBrushPoints, 1)},
                                  {"width_mm", 12.345678901234567}};
  EXPECT_LT(strokes.dump().size(), kSmallBody);
  const nlohmann::json outline = {{"kind", "withhold"},
                                  {"note", std::string(ranges::kLongestReason, '"')},
                                  {"outline_mm", std::vector<double>(2 * ranges::kMostCorners, longest)}};
  EXPECT_LT(outline.dump().size(), kSmallBody);
}

}  // namespace
}  // namespace veneer::daemon
