// Patches of several sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "base/polygon_ops.h"
#include "planner/files/plan_files.h"
#include "planner/layout/adaptive_grid.h"
#include "planner/plan.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_panel;

PlanOptions options_with(int levels, double factor) {
  PlanOptions options;
  options.patch = 4_mm, options.dpi = 50.8, options.rotations = 3, options.threads = 1;
  options.adaptive_levels = levels, options.adaptive_factor = factor;
  return options;
}

Plan planned(const Artwork& artwork, const std::vector<StockPanel>& stock, const PlanOptions& options) {
  return test::planned({artwork}, stock, options);
}

// Every cell of the grid belongs to exactly one piece, whose outline is the cell's share.
void expect_covered(const Plan& plan, GridSize grid) {
  std::map<std::pair<int, int>, int> owners;
  std::set<std::string> marks;
  double area = 0;
  for (const Piece& piece : plan.pieces) {
    EXPECT_TRUE(marks.insert(piece.mark).second) << piece.mark;
    EXPECT_EQ(piece.mark, "A" + std::to_string(piece.row + 1) + "-" + std::to_string(piece.column + 1));
    for (int r = 0; r < piece.cells; ++r)
      for (int c = 0; c < piece.cells; ++c) ++owners[{piece.row + r, piece.column + c}];
    area += signed_area(piece.artwork_outline);
  }
  EXPECT_EQ(owners.size(), static_cast<std::size_t>(grid.rows) * static_cast<std::size_t>(grid.columns));
  for (const auto& [cell, owned] : owners) {
    EXPECT_EQ(owned, 1);
    EXPECT_TRUE(cell.first < grid.rows && cell.second < grid.columns);
  }
  EXPECT_NEAR(area, (plan.artworks[0].width * plan.artworks[0].height).count(), 1e-6);
}

TEST(Adaptive, TheLayoutGathersCellsIntoSquaresAsFarAsTheBordersAllow) {
  const auto layout = adaptive_layout(24_mm, 20_mm, 4_mm, 2);  // 5 rows of 6 cells
  ASSERT_FALSE(layout.empty());
  EXPECT_EQ(layout.front().patch.cells, 4);
  EXPECT_EQ(layout.front().parts.size(), 4U);
  EXPECT_EQ(layout.front().parts.front().parts.size(), 4U);
  EXPECT_TRUE(layout.front().parts.front().parts.front().parts.empty());
  int cells = 0;
  for (const PatchTree& tree : layout) {
    cells += tree.patch.cells * tree.patch.cells;
    EXPECT_NEAR(signed_area(tree.patch.outline), 16.0 * tree.patch.cells * tree.patch.cells, 1e-9);
    EXPECT_LE(tree.patch.row + tree.patch.cells, 5);
    EXPECT_LE(tree.patch.column + tree.patch.cells, 6);
  }
  EXPECT_EQ(cells, 30);
}

TEST(Adaptive, PiecesBecomeFewerAsTheFactorRises) {
  const Artwork artwork = blob_artwork("A", 96, 80, 20_mm, 5);
  const std::vector<StockPanel> stock{wood_panel("P", 260, 220, 50.8, 6)};
  const GridSize grid = grid_size(artwork.width, artwork.height, 4_mm);
  std::vector<std::size_t> pieces;
  for (const double factor : {0.0, 0.9, 1.2, 2.0, 1e6}) {
    const Plan plan = planned(artwork, stock, options_with(2, factor));
    EXPECT_EQ(unfilled(plan), 0U);
    expect_covered(plan, grid);
    pieces.push_back(plan.pieces.size());
  }
  EXPECT_TRUE(std::is_sorted(pieces.rbegin(), pieces.rend()));
  EXPECT_EQ(pieces.front(), static_cast<std::size_t>(grid.rows * grid.columns));
  EXPECT_GT(pieces[2], pieces.back());
  EXPECT_LT(pieces.back(), pieces.front() / 3);
}

TEST(Adaptive, PlainPartsOfThePictureGetLargePatches) {
  Artwork artwork = blob_artwork("A", 80, 80, 32_mm, 7);
  artwork.picture.setTo(cv::Scalar::all(128));
  // On the left every cell has a tone of its own, which one large patch cannot follow.
  cv::RNG random(3);
  for (int row = 0; row < 8; ++row)
    for (int column = 0; column < 4; ++column)
      artwork.picture(cv::Rect(10 * column, 10 * row, 10, 10)).setTo(cv::Scalar::all(random.uniform(0, 256)));
  PlanOptions options = options_with(1, 1.5);
  options.rotations = 1;
  const Plan plan = planned(artwork, {wood_panel("P", 200, 200, 50.8, 8)}, options);
  int left = 0, right = 0;
  for (const Piece& piece : plan.pieces) ++(piece.column < 4 ? left : right);
  EXPECT_LE(right, 24);
  EXPECT_GE(left, 29);
}

TEST(Adaptive, NoWoodIsTakenTwiceAndThreadsDoNotMatter) {
  const Artwork artwork = blob_artwork("A", 60, 60, 28_mm, 9);
  const std::vector<StockPanel> stock{wood_panel("P", 90, 80, 50.8, 10)};
  PlanOptions options = options_with(1, 1.3);
  const Plan plan = planned(artwork, stock, options);
  EXPECT_GT(unfilled(plan), 0U);  // also when wood runs out
  EXPECT_LT(unfilled(plan), plan.pieces.size());
  expect_covered(plan, grid_size(artwork.width, artwork.height, 4_mm));
  std::vector<Region<PanelFrame>> taken;
  for (const Piece& piece : plan.pieces)
    if (piece.placement) taken.push_back(offset(Region<PanelFrame>(piece.panel_outline()), options.kerf));
  for (std::size_t i = 0; i < taken.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_EQ(intersect(taken[i], taken[j]).area().count(), 0.0);
  options.threads = 3;
  EXPECT_EQ(plan_to_json(planned(artwork, stock, options)), plan_to_json(plan));
  const auto back = plan_from_json(plan_to_json(plan));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(plan_to_json(*back), plan_to_json(plan));
}

TEST(Adaptive, UnimportantPartsStayLarge) {
  Artwork artwork = blob_artwork("A", 80, 80, 32_mm, 11);
  cv::randu(artwork.picture, 0, 255);
  artwork.importance = cv::Mat(2, 2, CV_8UC1, cv::Scalar(255));
  artwork.importance.col(1).setTo(0);
  cv::resize(artwork.importance, artwork.importance, {80, 80}, 0, 0, cv::INTER_NEAREST);
  const Plan plan = planned(artwork, {wood_panel("P", 180, 180, 50.8, 12)}, options_with(1, 0.98));
  for (const Piece& piece : plan.pieces) {
    if (piece.column >= 4) {
      EXPECT_EQ(piece.cells, 2) << piece.mark;
    }
  }
  EXPECT_TRUE(std::any_of(plan.pieces.begin(), plan.pieces.end(), [](const Piece& p) { return p.cells == 1; }));
}

TEST(Adaptive, SquaresLargerThanThePanelAreCutBeforehand) {
  const Artwork artwork = blob_artwork("A", 40, 40, 16_mm, 13);
  std::vector<StockPanel> stock;
  for (int i = 0; i < 12; ++i) stock.push_back(wood_panel("P" + std::to_string(i), 24, 24, 50.8, 20 + i));  // 12 mm
  const Plan plan = planned(artwork, stock, options_with(2, 1e6));
  for (const Piece& piece : plan.pieces) EXPECT_LE(piece.cells, 2);
  EXPECT_TRUE(std::any_of(plan.pieces.begin(), plan.pieces.end(), [](const Piece& p) { return p.cells == 2; }));
}

}  // namespace
}  // namespace veneer::planner
