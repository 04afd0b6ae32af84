// Which pixels belong to a patch, against asking each of them by itself.
#include "planner/matching/patch_pixels.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "planner/matching/banded_polygon.h"
#include "tests/support/patch_shapes.h"

namespace veneer::planner {
namespace {

constexpr int kSide = 40;
const PixelGrid kGrid{{2}, Millimetres(kSide / 2.0)};

Ring<ArtworkFrame> laid(const test::Shape& shape, double left, double bottom, double width, double height) {
  Ring<ArtworkFrame> out;
  for (const auto& [x, y] : shape) out.push_back(point<ArtworkFrame>(left + width * x, bottom + height * y));
  return out;
}

// By the winding of the outline around the point.
bool inside(const Ring<ArtworkFrame>& outline, double x, double y) {
  double sum = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double ax = a.x.count() - x, ay = a.y.count() - y, bx = b.x.count() - x, by = b.y.count() - y;
    sum += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  }
  return std::abs(sum) > kPi;
}

test::Shape any_shape() {
  const auto number = *rc::gen::inRange<std::size_t>(0, 1000);
  switch (number % 6) {
    case 0:
      return test::ell(number / 6);
    case 1:
      return test::crescent(number / 6);
    case 2:
      return test::meander(number / 6);
    case 3:
      return test::disc(0);
    default:
      return test::star(number);
  }
}

RC_GTEST_PROP(PatchPixels, AreThoseWhoseCentreLiesInside, ()) {
  const auto mm = [](int low, int high) { return *rc::gen::inRange(low, high) / 1000.0; };
  const test::Shape shape = any_shape();
  const double x = mm(-3000, 12000), y = mm(-3000, 12000), width = mm(300, 15000), height = mm(300, 15000);
  const Ring<ArtworkFrame> outline = laid(shape, x, y, width, height);
  const PatchPixels pixels = patch_pixels(outline, kGrid, kSide, kSide);
  cv::Mat counted(kSide, kSide, CV_8UC1, cv::Scalar(0));
  std::int64_t count = 0;
  for (const PatchPixels::Span& span : pixels.spans) {
    RC_ASSERT(span.begin < span.end);
    RC_ASSERT(span.row >= pixels.top && span.row < pixels.top + pixels.height);
    RC_ASSERT(span.begin >= pixels.left && span.end <= pixels.left + pixels.width);
    for (int c = span.begin; c < span.end; ++c) RC_ASSERT(counted.at<std::uint8_t>(span.row, c)++ == 0);
    count += span.length();
  }
  RC_ASSERT(count == pixels.count);
  for (std::size_t i = 1; i < pixels.spans.size(); ++i) {
    const PatchPixels::Span &before = pixels.spans[i - 1], &after = pixels.spans[i];
    RC_ASSERT(before.row < after.row || before.end < after.begin);
  }
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const bool expected = inside(outline, (column + 0.5) / 2, (kSide - row - 0.5) / 2);
      RC_ASSERT((counted.at<std::uint8_t>(row, column) != 0) == expected);
    }
  }
}

RC_GTEST_PROP(PatchPixels, OfNeighboursAreApartAndTogetherAll, ()) {
  // A square cut in two along a jagged line with corners on pixel centres too.
  std::vector<Point<ArtworkFrame>> line;
  const int corners = *rc::gen::inRange(1, 6);
  for (int k = 0; k <= corners + 1; ++k) {
    const double half = *rc::gen::inRange(8, 33) / 2.0, x = half + *rc::gen::inRange(0, 3) * 0.25;
    line.push_back(point<ArtworkFrame>(x, 20.0 * k / (corners + 1)));
  }
  Ring<ArtworkFrame> left{point<ArtworkFrame>(0, 20), point<ArtworkFrame>(0, 0)};
  left.insert(left.end(), line.begin(), line.end());
  Ring<ArtworkFrame> right{point<ArtworkFrame>(20, 0), point<ArtworkFrame>(20, 20)};
  right.insert(right.end(), line.rbegin(), line.rend());
  cv::Mat owners(kSide, kSide, CV_8UC1, cv::Scalar(0));
  for (const Ring<ArtworkFrame>& half : {left, right})
    for (const PatchPixels::Span& span : patch_pixels(half, kGrid, kSide, kSide).spans)
      owners.row(span.row).colRange(span.begin, span.end) += 1;
  RC_ASSERT(cv::countNonZero(owners == 1) == kSide * kSide);
}

TEST(PatchPixels, HaveSeveralSpansARowWhereTheOutlineTurnsBack) {
  const Ring<ArtworkFrame> outline = laid(test::meander(0), 0, 0, 20, 20);
  const PatchPixels pixels = patch_pixels(outline, kGrid, kSide, kSide);
  // A row through the middle: columns [0, 0.26), [0.34, 0.62) and [0.72, 1) of 40.
  std::vector<PatchPixels::Span> middle;
  for (const PatchPixels::Span& span : pixels.spans)
    if (span.row == 20) middle.push_back(span);
  EXPECT_EQ(middle, (std::vector<PatchPixels::Span>{{20, 0, 10}, {20, 14, 25}, {20, 29, 40}}));
  EXPECT_EQ(pixels.width, 40);
  EXPECT_FALSE(pixels.filled());
}

// Both directions of the axes, and with a hole: against many lines across the band.
RC_GTEST_PROP(BandedPolygon, CoversWhatItsPartInTheBandCovers, ()) {
  BandedPolygon::Corners corners;
  for (const auto& [x, y] : any_shape()) corners.x.push_back(10 * x), corners.y.push_back(10 * y);
  const double top = *rc::gen::inRange(-100, 1000) / 100.0, bottom = top + *rc::gen::inRange(0, 300) / 100.0;
  const BandedPolygon shape({corners});
  const auto covered = shape.within(top, bottom);
  Ring<ArtworkFrame> outline;
  for (std::size_t i = 0; i < corners.x.size(); ++i) outline.push_back(point<ArtworkFrame>(corners.x[i], corners.y[i]));
  for (double x = -0.503; x < 11; x += 0.1003) {
    bool expected = false;
    for (int k = 0; k <= 60; ++k) expected = expected || inside(outline, x, top + (bottom - top) * k / 60);
    const bool found =
        std::any_of(covered.begin(), covered.end(), [&](const auto& it) { return it.low <= x && x <= it.high; });
    RC_ASSERT(found || !expected);
    if (!found || expected) continue;
    // Between two of the lines: then close to the border.
    bool near = false;
    for (std::size_t i = 0; i < outline.size() && !near; ++i) {
      const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
      near = std::min(a.x, b.x).count() <= x + 1e-9 && std::max(a.x, b.x).count() >= x - 1e-9 &&
             std::min(a.y, b.y).count() <= bottom + 1e-9 && std::max(a.y, b.y).count() >= top - 1e-9;
    }
    RC_ASSERT(near);
  }
}

}  // namespace
}  // namespace veneer::planner
