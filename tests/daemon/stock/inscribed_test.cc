#include "daemon/stock/inscribed.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace veneer::daemon {
namespace {

// Four pixels to the millimetre, with its corner beside the panel's: what mixes up rows and heights is seen.
Raster<PanelFrame> wood(int columns, int rows, int value) {
  return {cv::Mat(rows, columns, CV_8UC1, cv::Scalar(value)), ScanResolution{4}, point<PanelFrame>(10, 20)};
}

// Rectangles of free wood with holes in them, of up to 24 x 20 pixels.
Raster<PanelFrame> any_wood() {
  const int columns = *rc::gen::inRange(1, 25), rows = *rc::gen::inRange(1, 21);
  auto out = wood(columns, rows, 0);
  const cv::Rect all(0, 0, out.pixels.cols, out.pixels.rows);
  const auto patch = [&](int most, int value) {
    const cv::Rect place{*rc::gen::inRange(0, all.width), *rc::gen::inRange(0, all.height), *rc::gen::inRange(1, most),
                         *rc::gen::inRange(1, most)};
    out.pixels(place & all) = value;
  };
  const int patches = *rc::gen::inRange(0, 4), holes = *rc::gen::inRange(0, 4);
  for (int i = 0; i < patches; ++i) patch(25, 255);
  for (int i = 0; i < holes; ++i) patch(4, 0);
  return out;
}

bool all_free(const Raster<PanelFrame>& free, int column, int row, int side) {
  const cv::Rect square(column, row, side, side);
  return (square & cv::Rect(0, 0, free.pixels.cols, free.pixels.rows)) == square &&
         cv::countNonZero(free.pixels(square)) == side * side;
}

template <class F>
void for_each_pixel(const Raster<PanelFrame>& raster, F visit) {
  for (int row = 0; row < raster.pixels.rows; ++row)
    for (int column = 0; column < raster.pixels.cols; ++column) visit(column, row);
}

// How far a place, in pixels, is from the nearest pixel that is not free, and from the raster's border.
double clearance_at(const Raster<PanelFrame>& free, double x, double y) {
  double least = std::min({x, y, free.pixels.cols - x, free.pixels.rows - y});
  for_each_pixel(free, [&](int column, int row) {
    if (free.pixels.at<unsigned char>(row, column) != 0) return;
    const double dx = std::max({column - x, x - column - 1, 0.0}), dy = std::max({row - y, y - row - 1, 0.0});
    least = std::min(least, std::hypot(dx, dy));
  });
  return least;
}

TEST(Inscribed, NothingFitsWhereNothingIsFree) {
  EXPECT_FALSE(largest_square(wood(5, 4, 0)));
  EXPECT_FALSE(largest_circle(wood(5, 4, 0)));
  EXPECT_TRUE(covered_by_squares(wood(5, 4, 0)).empty());
}

TEST(Inscribed, AWholePanelHoldsASquareAndACircleAsHighAsItIs) {
  auto all = wood(40, 20, 255);  // 10 x 5 mm
  EXPECT_EQ(largest_square(all)->side, 5_mm);
  EXPECT_EQ(largest_square(all)->min, point<PanelFrame>(10, 20));
  EXPECT_EQ(largest_circle(all)->radius, 2.5_mm);
  EXPECT_EQ(largest_circle(all)->centre.y, 22.5_mm);
  all.pixels(cv::Rect(8, 0, 4, 8)) = 0;  // x 12 to 13 mm, y 23 to 25 mm
  EXPECT_EQ(largest_square(all)->min, point<PanelFrame>(13, 20)) << "on the right of the hole";
}

RC_GTEST_PROP(Inscribed, NoSquareIsLargerThanTheLargest, ()) {
  const auto free = any_wood();
  const auto found = largest_square(free);
  int largest = 0;
  for_each_pixel(free, [&](int column, int row) {
    while (all_free(free, column, row, largest + 1)) ++largest;
  });
  RC_ASSERT(found.has_value() == (largest > 0));
  if (!found) return;
  RC_ASSERT(found->side.count() == largest / 4.0);
  double column = 0, row = 0;
  free.to_pixels(found->min, column, row);
  RC_ASSERT(
      all_free(free, static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row)) - largest, largest));
}

RC_GTEST_PROP(Inscribed, NoCircleIsLargerThanTheLargest, ()) {
  const auto free = any_wood();
  const auto found = largest_circle(free);
  double largest = 0;
  for (int y = 0; y <= 2 * free.pixels.rows; ++y)
    for (int x = 0; x <= 2 * free.pixels.cols; ++x) largest = std::max(largest, clearance_at(free, x / 2.0, y / 2.0));
  RC_ASSERT(found.has_value() == (largest > 0));
  if (!found) return;
  RC_ASSERT(std::abs(found->radius.count() - largest / 4) < 1e-6);
  double x = 0, y = 0;
  free.to_pixels(found->centre, x, y);
  RC_ASSERT(std::abs(clearance_at(free, x, y) - largest) < 1e-5);
}

RC_GTEST_PROP(Inscribed, WhatSquaresCoverIsTheUnionOfAllThatFit, ()) {
  const auto free = any_wood();
  const auto covered = covered_by_squares(free);
  for (int side = 1; side <= static_cast<int>(covered.size()) + 1; ++side) {
    cv::Mat expected = cv::Mat::zeros(free.pixels.size(), CV_8UC1);
    for_each_pixel(free, [&](int column, int row) {
      if (all_free(free, column, row, side)) expected(cv::Rect(column, row, side, side)) = 255;
    });
    const auto at = static_cast<std::size_t>(side) - 1;
    RC_ASSERT(cv::countNonZero(expected) == (at < covered.size() ? covered[at] : 0));
  }
}

// Wider than the words that pixels are counted in.
TEST(Inscribed, SquaresCoverWideWood) {
  auto wide = wood(300, 7, 255);
  EXPECT_EQ(covered_by_squares(wide), std::vector<std::int64_t>(7, 300 * 7));
  wide.pixels(cv::Rect(130, 0, 1, 3)) = 0;  // from above, so that 4 rows below it stay
  const std::vector<std::int64_t> expected = {2097, 2097, 2097, 2097, 2093, 2093, 2093};
  EXPECT_EQ(covered_by_squares(wide), expected);
}

RC_GTEST_PROP(Inscribed, ALargerPixelIsFreeWhenAllOfItIs, ()) {
  const auto free = any_wood();
  const int factor = *rc::gen::inRange(1, 5);
  const auto large = in_larger_pixels(free, factor);
  RC_ASSERT(large.width() >= free.width());
  RC_ASSERT(large.height() >= free.height());
  for_each_pixel(large, [&](int column, int row) {
    // Rows count from above, the raster stands on its lower edge.
    const int lower = free.pixels.rows - (large.pixels.rows - 1 - row) * factor;
    const bool whole = all_free(free, column * factor, lower - factor, factor);
    RC_ASSERT((large.pixels.at<unsigned char>(row, column) != 0) == whole);
  });
}

}  // namespace
}  // namespace veneer::daemon
