// Pieces turned and shifted continuously after they were placed.
#include "planner/poses/fine_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/polygon_ops.h"
#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"
#include "planner/matching/free_wood.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::planned;
using test::same_place;
using test::small_options_without_saliency;
using test::wood_panel;

PlanOptions fine(PlanOptions options) {
  options.fine_rotation = true;
  return options;
}

// Whether all outlines can be taken one after another, forwards and backwards through the plan.
bool admitted_in_both_orders(const Plan& plan, const StockPanel& panel, const PlanOptions& options) {
  std::vector<Ring<PanelFrame>> outlines;
  for (const Piece& piece : plan.pieces)
    if (piece.placement && piece.placement->panel == panel.id) outlines.push_back(piece.panel_outline());
  for (int order = 0; order < 2; ++order) {
    FreeWood wood(panel.free, options.kerf, options.position_margin);
    for (const Ring<PanelFrame>& outline : outlines) {
      if (!wood.admits(outline)) return false;
      wood.allocate(outline);
    }
    std::reverse(outlines.begin(), outlines.end());
  }
  return true;
}

bool share_wood(const Plan& plan, const StockPanel& panel, Millimetres kerf) {
  std::vector<Region<PanelFrame>> burnt;
  for (const Piece& piece : plan.pieces)
    if (piece.placement && piece.placement->panel == panel.id)
      burnt.push_back(offset(Region<PanelFrame>(piece.panel_outline()), kerf));
  for (std::size_t i = 0; i < burnt.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (intersect(burnt[i], burnt[j]).area().count() != 0.0) return true;
  return false;
}

bool rigid_copy(const Ring<ArtworkFrame>& a, const Ring<PanelFrame>& p) {
  if (a.size() != p.size() || std::abs(signed_area(a) - signed_area(p)) > 1e-9) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (std::abs((distance(a[i], a[j]) - distance(p[i], p[j])).count()) > 1e-9) return false;
  return true;
}

class FinePlanOfSeed : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(FinePlanOfSeed, MakesNoPieceDearerAndKeepsToTheWood) {
  const std::uint64_t seed = GetParam();
  cv::RNG random(seed);
  PlanOptions options = small_options_without_saliency();
  options.kerf = Millimetres(random.uniform(0, 50) / 100.0);
  options.position_margin = Millimetres(random.uniform(0, 3) / 10.0);
  options.rotations = random.uniform(1, 8);
  options.patch = Millimetres(random.uniform(40, 90) / 10.0);
  options.adaptive_levels = random.uniform(0, 2);
  const std::vector<StockPanel> stock{wood_panel("P", 60, 48, 50.8, seed), wood_panel("Q", 45, 40, 45, seed + 9)};
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 24_mm, seed + 1)};
  const Plan before = planned(artworks, stock, options), after = planned(artworks, stock, fine(options));
  ASSERT_TRUE(after.fine.has_value());
  ASSERT_EQ(after.pieces.size(), before.pieces.size());
  std::size_t moved = 0;
  for (std::size_t i = 0; i < after.pieces.size(); ++i) {
    const Piece &was = before.pieces[i], &is = after.pieces[i];
    ASSERT_EQ(is.placement.has_value(), was.placement.has_value());
    if (!is.placement) continue;
    EXPECT_TRUE(is.placement->panel == was.placement->panel);
    EXPECT_LE(is.cost, was.cost);
    EXPECT_TRUE(rigid_copy(is.artwork_outline, is.panel_outline()));
    const double degrees = to_degrees(is.placement->panel_from_artwork.angle());
    EXPECT_TRUE(degrees >= 0 && degrees < 360);
    moved += same_place(is, was) ? 0U : 1U;
  }
  EXPECT_EQ(after.fine->moved, moved);
  EXPECT_TRUE(std::abs(after.fine->cost_before - cost_total(before)) <= 1e-9 * cost_total(before));
  EXPECT_TRUE(std::abs(after.fine->cost - cost_total(after)) <= 1e-9 * cost_total(before));
  for (const StockPanel& panel : stock) {
    // Greedy's own plan may be tighter by FreeWood::kSlack, seen backwards.
    if (admitted_in_both_orders(before, panel, options)) {
      EXPECT_TRUE(admitted_in_both_orders(after, panel, options));
    }
    EXPECT_TRUE(!share_wood(after, panel, options.kerf));
    const FreeWood wood(panel.free, options.kerf, options.position_margin);
    for (const Piece& piece : after.pieces)
      if (piece.placement && piece.placement->panel == panel.id) {
        EXPECT_TRUE(wood.on_free_wood(piece.panel_outline())) << piece.mark;
      }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, FinePlanOfSeed, ::testing::Range<std::uint64_t>(1, 17));

class FinePlan : public ::testing::Test {
 protected:
  std::vector<Artwork> artworks_{blob_artwork("A", 50, 50, 42_mm, 31)};
  std::vector<StockPanel> stock_{wood_panel("P", 130, 100, 50.8, 33), wood_panel("Q", 70, 90, 60, 34)};
  PlanOptions options_ = fine(small_options_without_saliency());
};

TEST_F(FinePlan, IsCheaperAndMostPiecesMoveToAnglesInBetween) {
  const Plan plan = planned(artworks_, stock_, options_);
  EXPECT_LT(plan.fine->cost, 0.99 * plan.fine->cost_before);
  std::size_t between = 0;
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement) continue;
    const double turns = to_degrees(piece.placement->panel_from_artwork.angle()) / 72;
    between += std::abs(turns - std::round(turns)) > 1e-6 ? 1 : 0;
  }
  EXPECT_GT(between, plan.pieces.size() / 2);
}

TEST_F(FinePlan, IsTheSameForAnyNumberOfThreadsWhicheverWayPlacesAreChosen) {
  for (const Optimize optimize : {Optimize::kGreedy, Optimize::kGlobal}) {
    options_.optimize = optimize, options_.optimize_iterations = 5000, options_.threads = 1;
    const std::string alone = plan_to_json(planned(artworks_, stock_, options_));
    for (const int threads : {2, 5}) {
      options_.threads = threads;
      EXPECT_EQ(plan_to_json(planned(artworks_, stock_, options_)), alone) << threads << " threads";
    }
  }
}

TEST_F(FinePlan, IsNeverDearerThanTheGlobalOneItStartsFrom) {
  options_.optimize = Optimize::kGlobal, options_.optimize_iterations = 5000;
  const Plan plan = planned(artworks_, stock_, options_);
  EXPECT_NEAR(plan.fine->cost_before, plan.global->cost, 1e-9 * plan.global->cost);
  EXPECT_LT(plan.fine->cost, plan.fine->cost_before);
  for (const StockPanel& panel : stock_) {
    EXPECT_TRUE(admitted_in_both_orders(plan, panel, options_));
    EXPECT_FALSE(share_wood(plan, panel, options_.kerf));
  }
}

TEST_F(FinePlan, KeptPiecesStayAsTheyAreAndTheOthersKeepClearOfThem) {
  const Plan before = planned(artworks_, stock_, small_options_without_saliency());
  const std::vector<std::string> pinned{"A1-1", "A2-3", "A4-4"};
  options_.kept = *kept_pieces(before, Keep::kOnly, pinned, {});
  const Plan after = planned(artworks_, stock_, options_);
  for (std::size_t i = 0; i < after.pieces.size(); ++i)
    if (std::find(pinned.begin(), pinned.end(), after.pieces[i].mark) != pinned.end()) {
      EXPECT_TRUE(same_place(after.pieces[i], before.pieces[i])) << after.pieces[i].mark;
    }
  for (const StockPanel& panel : stock_) EXPECT_FALSE(share_wood(after, panel, options_.kerf));

  // A fine plan that is kept whole stays as it is.
  const Plan turned = planned(artworks_, stock_, fine(small_options_without_saliency()));
  options_.kept = *kept_pieces(turned, Keep::kAll, {}, {});
  EXPECT_EQ(plan_to_json(planned(artworks_, stock_, options_)), plan_to_json(turned));
}

TEST_F(FinePlan, IsNotAPlanYetWhenItIsStopped) {
  std::stop_source stop;
  const auto plan = make_plan(
      artworks_, stock_, options_,
      [&](double, std::string_view text) {
        if (text == "turning pieces finely") stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
