// What a person says about a morphed grid, edges that count and pinned vertices, and cells that become triangles.
#include "planner/layout/layout_guides.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "planner/layout/grid.h"
#include "planner/morph/morphed_grid.h"
#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

TEST(LayoutGuides, SizesOfCellsHaveThePicturesShapeAsFarAsWholeCellsCan) {
  const auto refusal = [](const cv::Mat& sizes, const cv::Size& picture, bool painted = false) {
    const Status good = painted ? check_painted_sizes(sizes, picture, "it") : check_cell_sizes(sizes, picture, "it");
    return good.ok() ? "" : good.error().message;
  };
  const auto mask = [](int columns, int rows) { return cv::Mat(rows, columns, CV_8UC1, cv::Scalar(0)); };
  EXPECT_EQ(refusal({}, {400, 400}), "");
  EXPECT_EQ(refusal(mask(5, 48), {400, 4000}), "") << "as job new makes it";
  EXPECT_EQ(refusal(mask(48, 5), {4000, 400}), "");
  EXPECT_EQ(refusal(mask(48, 1), {4000, 10}), "");
  EXPECT_EQ(refusal(mask(1, 48), {10, 4000}), "");
  EXPECT_EQ(refusal(mask(600, 406), {600, 400}), "");
  EXPECT_THAT(refusal(mask(600, 410), {600, 400}), HasSubstr("have 600 x 410 pixels, and the picture 600 x 400"));
  EXPECT_THAT(refusal(mask(410, 600), {400, 600}), HasSubstr("in its shape"));
  EXPECT_THAT(refusal(mask(7, 48), {400, 4000}), HasSubstr("in its shape"));
  EXPECT_THAT(refusal(cv::Mat(4, 6, CV_8UC3, cv::Scalar(0)), {6, 4}), HasSubstr("8-bit grey"));
  EXPECT_THAT(refusal(mask(6, 4), {6, 4}, true), HasSubstr("are black everywhere"));
  EXPECT_EQ(refusal(mask(6, 4), {6, 4}), "");
}

constexpr int kDrawn = 200;  // pixels of drawn pictures: two a millimetre
const PixelGrid kDrawnWork{{2}, 100_mm};

MorphOptions guided(LayoutGuides guides, Millimetres patch = 20_mm) {
  MorphOptions out{patch, {1.5_mm, patch * patch * 0.25}, std::min(5_mm, patch / 2)};
  out.guides = std::move(guides);
  return out;
}

Result<MorphedGrid> morph(const cv::Mat& grey, const MorphOptions& options) {
  cv::Mat bgr;
  cv::cvtColor(grey, bgr, cv::COLOR_GRAY2BGR);
  return morphed_grid(bgr, grey, 100_mm, kDrawnWork, options);
}

cv::Mat flat() { return {kDrawn, kDrawn, CV_8UC1, cv::Scalar(120)}; }

// Dark on the left, pale on the right of a line from the upper to the lower border; the grid's is at 80.
cv::Mat upright_step() {
  cv::Mat out(kDrawn, kDrawn, CV_8UC1, cv::Scalar(60));
  out.colRange(90, kDrawn).setTo(200);
  return out;
}

cv::Mat blobs(std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat out(kDrawn, kDrawn, CV_8UC1, cv::Scalar(random.uniform(0, 256)));
  for (int i = 0; i < 12; ++i) {
    const int tone = random.uniform(0, 256), turn = random.uniform(0, 180);
    const cv::Size axes{random.uniform(2, 90), random.uniform(2, 90)};
    const cv::Point middle{random.uniform(0, kDrawn), random.uniform(0, kDrawn)};
    cv::ellipse(out, middle, axes, turn, 0, 360, cv::Scalar(tone), cv::FILLED);
  }
  return out;
}

// How far the nearest end of an edge is from there.
double nearest_vertex(const Partition& partition, Millimetres x, Millimetres y) {
  double least = 1e9;
  for (const PartitionEdge& edge : partition.edges)
    for (const auto& p : {edge.curve.front(), edge.curve.back()})
      least = std::min(least, std::hypot((p.x - x).count(), (p.y - y).count()));
  return least;
}

std::string refusal(const std::vector<PinnedVertex>& pins, Millimetres patch = 20_mm) {
  const Result<MorphedGrid> made = morph(flat(), guided({{}, {}, pins}, patch));
  if (made.ok()) return "";
  EXPECT_EQ(made.error().code, ErrorCode::kInvalidArgument);
  return made.error().message;
}

TEST(LayoutGuides, WhatIsBlackHasNoEdges) {
  const cv::Mat black(10, 10, CV_8UC1, cv::Scalar(0));
  const Result<MorphedGrid> made = morph(upright_step(), guided({black, black, {}}));
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->partition, partition_of(100_mm, 100_mm, grid_layout(100_mm, 100_mm, 20_mm)));
}

TEST(LayoutGuides, EdgesOfOneFilterAloneAreFollowed) {
  const cv::Mat black(10, 10, CV_8UC1, cv::Scalar(0));
  for (const LayoutGuides& guides : {LayoutGuides{black, {}, {}}, LayoutGuides{{}, black, {}}}) {
    const Result<MorphedGrid> made = morph(upright_step(), guided(guides));
    ASSERT_TRUE(made.ok());
    EXPECT_NEAR(made->lines.lines[1](100), 90, 1.2);
  }
}

TEST(LayoutGuides, ALineFollowsTheEdgeWhereItCountsAndIsStraightWhereItDoesNot) {
  cv::Mat mask(kDrawn, kDrawn, CV_8UC1, cv::Scalar(0));
  mask.rowRange(0, 100).setTo(255);
  const Result<MorphedGrid> made = morph(upright_step(), guided({mask, mask, {}}));
  ASSERT_TRUE(made.ok());
  const CutLine& line = made->lines.lines[1];
  EXPECT_NEAR(line(20), 90, 1.2);
  EXPECT_NEAR(line(60), 90, 1.2);
  EXPECT_NEAR(line(190), 80, 6);
}

TEST(LayoutGuides, LinesMeetWhereAVertexIsPinned) {
  const std::vector<PinnedVertex> pins{{2, 2, {44.5_mm, 57_mm}}, {2, 3, {63_mm, 61_mm}}, {0, 1, {24_mm, 100_mm}}};
  for (const cv::Mat& picture : {flat(), upright_step(), blobs(5)}) {
    const MorphOptions options = guided({{}, {}, pins});
    const Result<MorphedGrid> made = morph(picture, options);
    ASSERT_TRUE(made.ok()) << made.error().message;
    for (const PinnedVertex& pin : pins)
      EXPECT_LE(nearest_vertex(made->partition, pin.at.x, pin.at.y), 0.001) << pin.row << ", " << pin.column;
    expect_exact_cover(made->partition);
    expect_fabricable(made->partition, options.limits);
  }
}

TEST(LayoutGuides, VerticesThatCannotBeThereAreRefusedWithAReason) {
  EXPECT_THAT(refusal({{6, 1, {20_mm, 0_mm}}}), HasSubstr("is none of the grid's: rows are 0 to 5"));
  EXPECT_THAT(refusal({{2, 2, {40_mm, 60_mm}}, {2, 2, {41_mm, 60_mm}}}), HasSubstr("is pinned twice"));
  EXPECT_THAT(refusal({{0, 2, {40_mm, 99_mm}}}), HasSubstr("must stay on it"));
  EXPECT_THAT(refusal({{0, 0, {1_mm, 100_mm}}}), HasSubstr("must stay on it"));
  EXPECT_THAT(refusal({{2, 2, {49_mm, 60_mm}}}), HasSubstr("may come 8.00 mm across"));
  EXPECT_THAT(refusal({{2, 2, {47_mm, 60_mm}}, {3, 2, {33_mm, 40_mm}}}), HasSubstr("would lean too much"));
  EXPECT_THAT(refusal({{2, 2, {Millimetres(std::nan("")), 60_mm}}}), HasSubstr("too far"));
  EXPECT_EQ(refusal({{2, 2, {47_mm, 60_mm}}}), "");
}

// A slope of 45 degrees: no line of a grid can follow it.
cv::Mat slope() {
  cv::Mat out(kDrawn, kDrawn, CV_8UC1, cv::Scalar(60));
  for (int r = 0; r < kDrawn; ++r)
    for (int c = 0; c < kDrawn; ++c)
      if (c > r) out.at<std::uint8_t>(r, c) = 200;
  return out;
}

TEST(SplitCells, AnEdgeAlongADiagonalMakesTriangles) {
  MorphOptions options = guided({});  // in a straight grid the slope runs along the diagonals of five cells
  options.triangles = true;
  const cv::Mat black(10, 10, CV_8UC1, cv::Scalar(0));
  const Result<MorphedGrid> made = morph(slope(), options);
  ASSERT_TRUE(made.ok());
  EXPECT_GE(made->figures.split, 3U);
  EXPECT_EQ(made->partition.faces.size(), 25 + made->figures.split);
  expect_exact_cover(made->partition);
  expect_fabricable(made->partition, options.limits);
  std::size_t triangles = 0;
  for (const PartitionFace& face : made->partition.faces) triangles += face.boundary.size() == 3 ? 1 : 0;
  EXPECT_EQ(triangles, 2 * made->figures.split);
  MorphOptions squares = options;
  squares.triangles = false;
  const Result<MorphedGrid> of_squares = morph(slope(), squares);
  ASSERT_TRUE(of_squares.ok());
  EXPECT_GT(made->figures.edges_after, of_squares->figures.edges_after + 0.3) << "the cuts are borders, too";
  EXPECT_LE(made->figures.edges_after, 1);
  // Where edges do not count, there is nothing to be split along.
  options.guides.large = options.guides.fine = black;
  const Result<MorphedGrid> whole = morph(slope(), options);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->figures.split, 0U);
}

RC_GTEST_PROP(SplitCells, AnyPictureAndAnyPinsCanBeCutAndDoNotDependOnThreads, ()) {
  MorphOptions options = guided({}, Millimetres(*rc::gen::inRange(9, 40)));
  const GridSize size = grid_size(100_mm, 100_mm, options.patch);
  std::set<std::pair<int, int>> taken;
  for (int i = *rc::gen::inRange(0, 4); i > 0; --i) {
    const int row = *rc::gen::inRange(0, size.rows + 1), column = *rc::gen::inRange(0, size.columns + 1);
    if (!taken.emplace(row, column).second) continue;
    const auto aside = [&](bool border, int count) { return border ? 0 : *rc::gen::inRange(-39, 40) / 100.0 / count; };
    const bool side = column == 0 || column == size.columns, end = row == 0 || row == size.rows;
    options.guides.vertices.push_back(
        {row,
         column,
         {100_mm * (static_cast<double>(column) / size.columns + aside(side, size.columns)),
          100_mm * (1 - static_cast<double>(row) / size.rows + aside(end || side, size.rows))}});
  }
  options.triangles = *rc::gen::arbitrary<bool>();
  const cv::Mat picture = blobs(*rc::gen::arbitrary<std::uint64_t>());
  const Result<MorphedGrid> made = morph(picture, options);
  if (!made.ok()) {
    // Pins may lie in each other's way, nothing else may.
    RC_ASSERT(options.guides.vertices.size() > 1);
    RC_ASSERT(made.error().code == ErrorCode::kInvalidArgument);
    return;
  }
  expect_exact_cover(made->partition);
  expect_fabricable(made->partition, options.limits);
  for (const PinnedVertex& pin : options.guides.vertices)
    RC_ASSERT(nearest_vertex(made->partition, pin.at.x, pin.at.y) <= 0.001);
  RC_ASSERT(made->partition.faces.size() == static_cast<std::size_t>(size.rows * size.columns) + made->figures.split);
  options.threads = 3;
  RC_ASSERT(morph(picture, options)->partition == made->partition);
}

}  // namespace
}  // namespace veneer::planner
