#include "planner/cutting/marks.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string>

#include "base/polygon_ops.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

const Radians kUp = degrees(90);

Ring<BedFrame> rectangle(double x, double y, double width, double height, double turn_deg = 0) {
  Ring<BedFrame> ring;
  const double c = std::cos(degrees(turn_deg).count()), s = std::sin(degrees(turn_deg).count());
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {width, 0.0}, {width, height}, {0.0, height}})
    ring.push_back(point<BedFrame>(x + c * u - s * v, y + s * u + c * v));
  return ring;
}

Box<BedFrame> box_of(const Mark& mark) {
  Box<BedFrame> box;
  for (const auto& stroke : mark.strokes)
    for (const auto& p : stroke) box.add(p);
  return box;
}

// Inside the outline, a margin away from its edge.
void expect_inside(const Mark& mark, const Ring<BedFrame>& outline, Millimetres margin = 0.8_mm) {
  const auto inner = offset(Region<BedFrame>(outline), 0.002_mm - margin);
  for (const auto& stroke : mark.strokes)
    for (const auto& p : stroke) EXPECT_TRUE(inner.contains(p));
}

TEST(Marks, HaveEveryCharacterAMarkMayCarry) {
  const auto square = rectangle(0, 0, 20, 20);
  for (const char c : std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-"))
    EXPECT_TRUE(lay_out_mark({&c, 1}, square, kUp).ok()) << c;
  for (const char* none : {"a", " ", "A a"})
    EXPECT_EQ(lay_out_mark(none, square, kUp).error().code, ErrorCode::kInvalidArgument) << none;
}

TEST(Marks, ReadFromLeftToRightSeenFromAbove) {
  // An L has its stem at the left of its foot, and the mark's first character is left of its last.
  const auto mark = lay_out_mark("LL", rectangle(100, 50, 14, 12), kUp);
  ASSERT_TRUE(mark.ok());
  ASSERT_EQ(mark->strokes.size(), 3U);
  const auto& first = mark->strokes[0];
  const auto& second = mark->strokes[1];
  EXPECT_LT(first[0].x, first[2].x) << "stem left, foot right";
  EXPECT_GT(first[0].y, first[1].y) << "stem above foot";
  EXPECT_LT(first[0].x, second[0].x);
}

TEST(Marks, StandOverABarAsLongAsTheText) {
  const auto mark = lay_out_mark("A3-12", rectangle(0, 0, 14, 12), kUp);
  ASSERT_TRUE(mark.ok());
  const auto& bar = mark->strokes.back();
  ASSERT_EQ(bar.size(), 2U);
  EXPECT_NEAR(bar[0].y.count(), bar[1].y.count(), 1e-9);
  const auto box = box_of(*mark);
  EXPECT_NEAR((bar[1].x - bar[0].x).count(), box.width().count(), 1e-9);
  for (std::size_t i = 0; i + 1 < mark->strokes.size(); ++i)
    for (const auto& p : mark->strokes[i]) EXPECT_GT((p.y - bar[0].y).count(), 0.25 * mark->height.count());
}

TEST(Marks, AreFullHeightOnTwelveMillimetrePieces) {
  const auto mark = lay_out_mark("A3-12", rectangle(0, 0, 12, 12), kUp);
  ASSERT_TRUE(mark.ok());
  EXPECT_NEAR(mark->height.count(), 2.4, 1e-9);
  EXPECT_NEAR(mark->up.count(), kUp.count(), 1e-12);
}

TEST(Marks, ShrinkDownToTheLeastHeightAndThenRefuse) {
  const auto small = lay_out_mark("A3-12", rectangle(0, 0, 10, 10), kUp);
  ASSERT_TRUE(small.ok());
  EXPECT_LT(small->height.count(), 2.4);
  EXPECT_GE(small->height.count(), 2.0);
  const auto small_piece = rectangle(0, 0, 6.5, 6.5);
  const auto close = lay_out_mark("A3-12", small_piece, kUp);
  ASSERT_TRUE(close.ok());
  EXPECT_GE(close->height.count(), 2.0) << "nearer to the outline rather than smaller";
  expect_inside(*close, small_piece, 0.4_mm);
  const auto smaller_piece = rectangle(0, 0, 5, 5);
  const auto smallest = lay_out_mark("A3-12", smaller_piece, kUp);
  ASSERT_TRUE(smallest.ok());
  EXPECT_LT(smallest->height.count(), 2.0);
  EXPECT_GE(smallest->height.count(), 1.4);
  expect_inside(*smallest, smaller_piece, 0.4_mm);
  const auto tiny = lay_out_mark("A3-12", rectangle(0, 0, 4, 4), kUp);
  ASSERT_FALSE(tiny.ok());
  EXPECT_EQ(tiny.error().code, ErrorCode::kRefused);
  EXPECT_THAT(tiny.error().message, HasSubstr("A3-12"));
}

TEST(Marks, StandOnTwoLinesOverOneBarWhereOneLineFindsNoRoom) {
  const auto mark = lay_out_mark("A12-27", rectangle(0, 0, 8, 8), kUp);
  ASSERT_TRUE(mark.ok()) << mark.error().message;
  EXPECT_NEAR(mark->up.count(), kUp.count(), 1e-12);
  const auto box = box_of(*mark);
  EXPECT_GT(box.height().count(), 2.5 * mark->height.count());
  const auto& bar = mark->strokes.back();
  EXPECT_NEAR((bar[1].x - bar[0].x).count(), box.width().count(), 1e-9);
  expect_inside(*mark, rectangle(0, 0, 8, 8));
  // The A stands over the hyphen.
  EXPECT_GT(mark->strokes.front()[0].y - bar[0].y, 1.5 * mark->height);
  // One that counts in reading order is broken in its middle.
  const auto counted = lay_out_mark("A312", rectangle(0, 0, 6.5, 8), kUp);
  ASSERT_TRUE(counted.ok()) << counted.error().message;
  EXPECT_GT(box_of(*counted).height().count(), 2.5 * counted->height.count());
}

TEST(Marks, OfTwoOrThreeSignsFindRoomWhereThoseThatTellPlacesFindNone) {
  const auto on = [](const char* text, double side) {
    auto mark = lay_out_mark(text, rectangle(0, 0, side, side), kUp);
    if (mark.ok()) expect_inside(*mark, rectangle(0, 0, side, side), 0.4_mm);
    return mark.ok() ? mark->height.count() : 0;
  };
  EXPECT_LT(on("A1-10", 5.8), 2.0);
  EXPECT_GE(on("7K2", 5.8), 2.0);
  EXPECT_GE(on("7K", 4), 2.0);
  EXPECT_EQ(on("A1-10", 4.3), 0);
  EXPECT_GE(on("7K2", 4.3), 1.4);
  EXPECT_GE(on("7K", 3.2), 1.4);
}

// Every mark of a picture of 40 x 40 squares, and of a mosaic of 999 cells.
TEST(Marks, OfWholePicturesAreReadWithoutEffortDownToSevenMillimetresAndFitDownToFive) {
  std::vector<std::string> marks;
  for (int row = 1; row <= 40; row += 3)
    for (int column = 1; column <= 40; column += 3) marks.push_back(fmt::format("A{}-{}", row, column));
  for (int number = 1; number <= 999; number += 37) marks.push_back(fmt::format("B{}", number));
  for (const auto& [side, least] : {std::pair(8.0, 2.0), {7.0, 2.0}, {5.0, 1.4}})
    for (const std::string& text : marks) {
      const auto mark = lay_out_mark(text, rectangle(0, 0, side, side), kUp);
      ASSERT_TRUE(mark.ok()) << text << " on " << side << " mm: " << mark.error().message;
      EXPECT_GE(mark->height.count(), least) << text << " on " << side << " mm";
      std::string lines;
      for (const std::string& line : mark->lines) lines += line;
      EXPECT_EQ(lines, text);
    }
}

// A small piece of a mosaic: no box finds room below its bow, but beside the top of an A there is.
TEST(Marks, KeepOnlyTheirInkInsideWhereNoBoxFits) {
  const Ring<BedFrame> arch = {point<BedFrame>(6.0, 0.1), point<BedFrame>(6.6, 5.5), point<BedFrame>(4.2, 5.1),
                               point<BedFrame>(3.9, 3.6), point<BedFrame>(3.5, 2.8), point<BedFrame>(3.0, 2.5),
                               point<BedFrame>(2.5, 2.8), point<BedFrame>(2.1, 3.8), point<BedFrame>(1.8, 5.0),
                               point<BedFrame>(0.8, 4.3), point<BedFrame>(0, 1.1),   point<BedFrame>(3.3, 0)};
  const auto mark = lay_out_mark("A6", arch, kUp);
  ASSERT_TRUE(mark.ok()) << mark.error().message;
  EXPECT_GE(mark->height.count(), 1.4);
  expect_inside(*mark, arch, 0.4_mm);
}

TEST(Marks, HaveABarThatIsNoShorterThanACapitalIsHigh) {
  const auto mark = lay_out_mark("A5", rectangle(0, 0, 2.5, 6), kUp);
  ASSERT_TRUE(mark.ok()) << mark.error().message;
  EXPECT_GT(box_of(*mark).height().count(), 2.5 * mark->height.count()) << "two lines of one character";
  const auto& bar = mark->strokes.back();
  EXPECT_GE(distance(bar[0], bar[1]).count(), mark->height.count() - 1e-9);
}

TEST(Marks, TurnAQuarterOnPiecesTooNarrowForThem) {
  const auto mark = lay_out_mark("A3-12", rectangle(0, 0, 5, 14), kUp);
  ASSERT_TRUE(mark.ok());
  EXPECT_NEAR(std::abs(std::sin(mark->up.count())), 0, 1e-12);
}

TEST(Marks, LieAlongASliverThatLeansAnyWay) {
  for (int turn = 0; turn < 180; turn += 7) {
    const auto sliver = rectangle(50, 50, 14, 5, turn);
    const auto mark = lay_out_mark("A3-12", sliver, kUp);
    ASSERT_TRUE(mark.ok()) << turn << " degrees: " << mark.error().message;
    expect_inside(*mark, sliver);
    // Of the two ways along the sliver the one that is less upside down.
    EXPECT_GT(std::sin(mark->up.count()), -0.01) << turn;
  }
}

TEST(Marks, FindRoomInTrianglesAlongTheirLongEdge) {
  // The only wide place of a leaning triangle is beside its long edge.
  for (int turn = 0; turn < 360; turn += 11) {
    const double c = std::cos(degrees(turn).count()), s = std::sin(degrees(turn).count());
    Ring<BedFrame> triangle;
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {20.0, 0.0}, {3.0, 9.0}})
      triangle.push_back(point<BedFrame>(c * u - s * v, s * u + c * v));
    const auto mark = lay_out_mark("A3-12", triangle, kUp);
    ASSERT_TRUE(mark.ok()) << turn << " degrees: " << mark.error().message;
    expect_inside(*mark, triangle);
  }
}

TEST(Marks, AvoidTheNotchOfAnLShapedPiece) {
  const Ring<BedFrame> l = {point<BedFrame>(0, 0), point<BedFrame>(14, 0), point<BedFrame>(14, 6),
                            point<BedFrame>(6, 6), point<BedFrame>(6, 14), point<BedFrame>(0, 14)};
  const auto mark = lay_out_mark("A3-12", l, kUp);
  ASSERT_TRUE(mark.ok());
  for (const auto& stroke : mark->strokes)
    for (const auto& p : stroke) EXPECT_LT(p.y.count(), 6);
}

TEST(Marks, RefuseCharactersTheyCannotDraw) {
  EXPECT_EQ(lay_out_mark("a1", rectangle(0, 0, 20, 20), kUp).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(lay_out_mark("", rectangle(0, 0, 20, 20), kUp).error().code, ErrorCode::kInvalidArgument);
}

TEST(Marks, DrawEachCharacterUnlikeTheOneItIsMixedUpWith) {
  // Shapes compared point by point on a raster of 0.1 of the height, each in its own box.
  const auto ink = [](char c) {
    const auto mark = lay_out_mark(std::string(1, c), rectangle(0, 0, 20, 20), kUp);
    std::vector<Point<BedFrame>> points;
    for (std::size_t i = 0; i + 1 < mark->strokes.size(); ++i) {
      const auto& stroke = mark->strokes[i];
      for (std::size_t k = 1; k < stroke.size(); ++k)
        for (int t = 0; t <= 10; ++t)
          points.push_back(point<BedFrame>(
              stroke[k - 1].x.count() + (stroke[k].x - stroke[k - 1].x).count() * t / 10 - box_of(*mark).min.x.count(),
              stroke[k - 1].y.count() + (stroke[k].y - stroke[k - 1].y).count() * t / 10));
    }
    return points;
  };
  const auto farthest = [](const auto& from, const auto& to) {
    double most = 0;
    for (const auto& p : from) {
      double least = 1e9;
      for (const auto& q : to) least = std::min(least, distance(p, q).count());
      most = std::max(most, least);
    }
    return most;
  };
  for (const auto& [a, b] : {std::pair{'0', 'O'}, {'1', 'I'}, {'5', 'S'}, {'6', '9'}, {'8', 'B'}, {'2', 'Z'}}) {
    const auto ink_a = ink(a), ink_b = ink(b);
    EXPECT_GT(std::max(farthest(ink_a, ink_b), farthest(ink_b, ink_a)), 0.3) << a << " and " << b << " (mm)";
  }
}

RC_GTEST_PROP(Marks, StayInsideTheirPieceWithTheMargin, ()) {
  const double width = *rc::gen::inRange(30, 400) / 10.0, height = *rc::gen::inRange(30, 400) / 10.0;
  const double turn = *rc::gen::inRange(0, 360), up = *rc::gen::inRange(0, 360);
  const auto outline = rectangle(200, 150, width, height, turn);
  const auto mark = lay_out_mark("B12-7", outline, degrees(up));
  if (!mark.ok()) {
    RC_ASSERT(mark.error().code == ErrorCode::kRefused);
    return;
  }
  // A micrometre for the rounding of regions.
  const auto inner = offset(Region<BedFrame>(outline), Millimetres(-0.4 + 0.002));
  for (const auto& stroke : mark->strokes)
    for (const auto& p : stroke) RC_ASSERT(inner.contains(p));
}

RC_GTEST_PROP(Marks, TurnWithTheirPiece, ()) {
  const double turn = *rc::gen::inRange(0, 360);
  const auto straight = lay_out_mark("A3-12", rectangle(0, 0, 14, 12), kUp);
  const auto turned = lay_out_mark("A3-12", rectangle(0, 0, 14, 12, turn), degrees(90 + turn));
  RC_ASSERT(straight.ok() && turned.ok());
  const double c = std::cos(degrees(turn).count()), s = std::sin(degrees(turn).count());
  for (std::size_t i = 0; i < straight->strokes.size(); ++i) {
    for (std::size_t k = 0; k < straight->strokes[i].size(); ++k) {
      const auto& p = straight->strokes[i][k];
      const auto expected = point<BedFrame>(c * p.x.count() - s * p.y.count(), s * p.x.count() + c * p.y.count());
      RC_ASSERT(distance(expected, turned->strokes[i][k]).count() < 0.01);
    }
  }
}

}  // namespace
}  // namespace veneer::planner
