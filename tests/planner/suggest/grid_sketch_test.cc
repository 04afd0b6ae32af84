#include "planner/suggest/grid_sketch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// 100 x 100 mm in 5 x 5 cells: dark on the left, pale on the right of 45 mm, where the grid has a line at 40.
Artwork step_artwork() {
  Artwork out;
  out.name = "step", out.letter = "A";
  out.width = out.height = 100_mm;
  out.picture = cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(60));
  out.picture.colRange(90, 200).setTo(cv::Scalar::all(200));
  return out;
}

PlanOptions morphed_options() {
  PlanOptions out;
  out.layout = LayoutKind::kMorph, out.patch = 20_mm, out.threads = 1;
  return out;
}

const Point<ArtworkFrame>& vertex(const GridPreview& grid, int row, int column) {
  return grid.vertices[static_cast<std::size_t>(row * (grid.size.columns + 1) + column)];
}

GridPreview drawn(const Artwork& artwork, GridEffort effort, const PlanOptions& options = morphed_options()) {
  auto out = sketch_grid(artwork, options, effort);
  if (!out.ok()) throw std::runtime_error(out.error().message);
  return std::move(*out);
}

class GridSketch : public ::testing::TestWithParam<GridEffort> {};

TEST_P(GridSketch, LinesFollowTheEdgesAndMeetInTheVertices) {
  const GridPreview grid = drawn(step_artwork(), GetParam());
  ASSERT_EQ(grid.size.rows, 5);
  ASSERT_EQ(grid.size.columns, 5);
  ASSERT_EQ(grid.vertices.size(), 36U);
  ASSERT_EQ(grid.lines.size(), 8U);
  for (const auto& at : grid.lines[1]) EXPECT_NEAR(at.x.count(), 45, 1.5);
  EXPECT_NEAR(grid.lines[1].front().y.count(), 100, 1e-9) << "from above";
  EXPECT_NEAR(grid.lines[1].back().y.count(), 0, 1e-9);
  EXPECT_NEAR(grid.lines[4].front().x.count(), 0, 1e-9) << "then level ones, from the left";
  EXPECT_NEAR(grid.lines[4].front().y.count(), 80, 1) << "from above";
  for (int row = 0; row <= 5; ++row) {
    EXPECT_NEAR(vertex(grid, row, 2).x.count(), 45, 1.5) << row;
    EXPECT_NEAR(vertex(grid, row, 2).y.count(), 100 - 20 * row, 1) << row;
    EXPECT_NEAR(vertex(grid, row, 0).x.count(), 0, 1e-9);
    EXPECT_NEAR(vertex(grid, row, 5).x.count(), 100, 1e-9);
  }
}

TEST_P(GridSketch, FollowsWhatIsPaintedAndPinned) {
  Artwork artwork = step_artwork();
  artwork.guides.large = artwork.guides.fine = cv::Mat(1, 1, CV_8UC1, cv::Scalar(0));
  artwork.guides.vertices = {{2, 3, {63.5_mm, 57.25_mm}}, {0, 2, {43_mm, 100_mm}}};
  const GridPreview grid = drawn(artwork, GetParam());
  EXPECT_NEAR(vertex(grid, 2, 3).x.count(), 63.5, 0.1);
  EXPECT_NEAR(vertex(grid, 2, 3).y.count(), 57.25, 0.1);
  EXPECT_NEAR(vertex(grid, 0, 2).x.count(), 43, 0.3);
  EXPECT_NEAR(vertex(grid, 5, 2).x.count(), 40, 1) << "no edge counts";
}

TEST_P(GridSketch, RefusesWhatAPlanWouldAndGridsThatNobodyCouldSee) {
  Artwork artwork = step_artwork();
  artwork.guides.vertices = {{2, 3, {75_mm, 60_mm}}};
  const auto far_away = sketch_grid(artwork, morphed_options(), GetParam());
  ASSERT_FALSE(far_away.ok());
  EXPECT_THAT(far_away.error().message, HasSubstr("too far from where the straight grid has it"));
  PlanOptions fine = morphed_options();
  fine.patch = 1_mm;
  const auto many = sketch_grid(step_artwork(), fine, GetParam());
  ASSERT_FALSE(many.ok());
  EXPECT_EQ(many.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(many.error().message, HasSubstr("10000 pieces"));
}

INSTANTIATE_TEST_SUITE_P(Efforts, GridSketch, ::testing::Values(GridEffort::kCoarse, GridEffort::kFine));

}  // namespace
}  // namespace veneer::planner
