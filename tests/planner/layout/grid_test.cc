#include "planner/layout/grid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "planner/matching/patch_pixels.h"
#include "planner/plan.h"

namespace veneer::planner {
namespace {

TEST(GridLayout, HasRoundedNumbersOfPatchesAndAtLeastOne) {
  const GridSize size = grid_size(360_mm, 245_mm, 14_mm);
  EXPECT_EQ(size.columns, 26);
  EXPECT_EQ(size.rows, 18);
  const GridSize one = grid_size(5_mm, 5_mm, 14_mm);
  EXPECT_EQ(one.columns, 1);
  EXPECT_EQ(one.rows, 1);
}

TEST(GridLayout, CountsRowsFromTheUpperLeftAndMarksFromOne) {
  const auto patches = grid_layout(40_mm, 20_mm, 10_mm);
  ASSERT_EQ(patches.size(), 8U);
  EXPECT_EQ(patches[0].row, 0);
  EXPECT_EQ(bounds(patches[0].outline).max.y, 20_mm);
  EXPECT_EQ(bounds(patches[7].outline).min.y, 0_mm);
  EXPECT_EQ(mark_of("A", patches[5]), "A2-2");
}

TEST(GridLayout, LettersGoOnAfterZ) {
  EXPECT_EQ(artwork_letter(0), "A");
  EXPECT_EQ(artwork_letter(25), "Z");
  EXPECT_EQ(artwork_letter(26), "AA");
  EXPECT_EQ(artwork_letter(53), "BB");
}

RC_GTEST_PROP(GridLayout, CoversTheArtworkWithoutOverlap, ()) {
  const Millimetres width(*rc::gen::inRange(10, 4000) / 10.0), height(*rc::gen::inRange(10, 4000) / 10.0);
  const Millimetres patch(*rc::gen::inRange(20, 500) / 10.0);
  const auto patches = grid_layout(width, height, patch);
  double area = 0;
  Box<ArtworkFrame> all;
  for (const Patch& p : patches) {
    RC_ASSERT(signed_area(p.outline) > 0);
    area += signed_area(p.outline);
    for (const auto& corner : p.outline) all.add(corner);
  }
  RC_ASSERT(std::abs(area - (width * height).count()) < 1e-6 * area);
  RC_ASSERT(all.min.x == Millimetres(0) && all.min.y == Millimetres(0) && all.max.x == width && all.max.y == height);
}

RC_GTEST_PROP(PatchPixels, EveryPixelOfTheArtworkBelongsToOnePatch, ()) {
  const Millimetres width(*rc::gen::inRange(100, 1000) / 10.0), height(*rc::gen::inRange(100, 1000) / 10.0);
  const Millimetres patch(*rc::gen::inRange(30, 300) / 10.0);
  const PixelGrid grid{ScanResolution::from_dpi(*rc::gen::inRange(30, 120)), height};
  const int columns = working_pixels(width, grid.resolution);
  const int rows = working_pixels(height, grid.resolution);
  std::vector<int> owners(static_cast<std::size_t>(columns * rows), 0);
  std::int64_t count = 0;
  for (const Patch& p : grid_layout(width, height, patch)) {
    const PatchPixels pixels = patch_pixels(p.outline, grid, columns, rows);
    count += pixels.count;
    for (const PatchPixels::Span& span : pixels.spans)
      for (int c = span.begin; c < span.end; ++c) ++owners[static_cast<std::size_t>(span.row * columns + c)];
  }
  for (const int n : owners) RC_ASSERT(n == 1);
  RC_ASSERT(count == static_cast<std::int64_t>(owners.size()));
}

TEST(PatchPixels, CountsCentresInsideATriangle) {
  const PixelGrid grid{{1}, 4_mm};
  const Ring<ArtworkFrame> triangle{point<ArtworkFrame>(0, 0), point<ArtworkFrame>(4, 0), point<ArtworkFrame>(0, 4)};
  const PatchPixels pixels = patch_pixels(triangle, grid, 4, 4);
  // Rows from above hold 0.5, 1.5, 2.5 and 3.5 mm of width at their centres, the slope itself excluded.
  EXPECT_EQ(pixels.count, 0 + 1 + 2 + 3);
}

}  // namespace
}  // namespace veneer::planner
