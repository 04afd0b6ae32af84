// Windows of any size share few indexes.
#include "planner/matching/odd_windows.h"

#include <gtest/gtest.h>

namespace veneer::planner {
namespace {

WindowClass odd(int least_side, int most_side) {
  WindowClass out;
  out.filled = false;
  out.width = out.height = least_side, out.widest = out.tallest = most_side;
  out.least = static_cast<std::int64_t>(least_side) * least_side;
  out.most = static_cast<std::int64_t>(most_side) * most_side;
  return out;
}

PatchPixels window(int width, int height) {
  PatchPixels out;
  out.width = width, out.height = height;
  return out;
}

double blocks(const OddWindows& windows, int width, int height) {
  const CellGrid grid = windows.grid(windows.scale_of(window(width, height)));
  return width * height / (4 * grid.width * grid.height);
}

TEST(OddWindows, ThereAreNoneWhereAllAreFilled) {
  WindowClass filled;
  filled.width = filled.height = filled.widest = filled.tallest = 48;
  EXPECT_EQ(OddWindows({filled}).scales(), 0U);
}

TEST(OddWindows, SeveralClassesShareOneIndexUnlessTheirAreasAreFarApart) {
  EXPECT_EQ(OddWindows({odd(40, 44), odd(50, 60), odd(61, 66)}).scales(), 1U);
  EXPECT_EQ(OddWindows({odd(40, 44), odd(50, 60), odd(61, 100)}).scales(), 2U);
  EXPECT_LE(OddWindows({odd(20, 400)}).scales(), 6U) << "areas 400 times as large";
}

TEST(OddWindows, EachWindowIsSeenInEnoughBlocksAndInNoMoreThanScoresHaveRoomFor) {
  const OddWindows windows({odd(20, 90), odd(100, 300)});
  for (int side = 20; side <= 300; ++side) {
    EXPECT_LE(blocks(windows, side, side), 36 + 1e-6) << side;
    EXPECT_GE(blocks(windows, side, side), 11) << side;
  }
  // Long ones as well: it is the area that counts.
  EXPECT_LE(blocks(windows, 300, 20), 36 + 1e-6);
}

TEST(OddWindows, BlocksCoverTheWholeWindow) {
  const CellGrid scale = cells_of(4.5, 4.5), grid = cells_over(scale, 50, 9);
  EXPECT_EQ(grid.columns, 12);
  EXPECT_EQ(grid.rows, 2);
  EXPECT_GE(grid.columns * grid.width, 50);
}

}  // namespace
}  // namespace veneer::planner
