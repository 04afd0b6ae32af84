// The certified matcher against exhaustive search.
#include "planner/matching/certified_matcher.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "planner/problem/problem.h"
#include "tests/support/exhaustive_matching.h"
#include "tests/support/patch_shapes.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_panel;

// Every lattice place of every panel and rotation, one by one.
std::optional<LatticeCandidate> exhaustive(const Matcher& matcher, const MatchPatch& patch, int rotations) {
  LatticeCandidate best;
  for (int panel = 0; panel < static_cast<int>(matcher.panels().size()); ++panel) {
    for (int rotation = 0; rotation < rotations; ++rotation) {
      const Lattice& lattice = matcher.lattice(panel, rotation);
      for (int y = -1; y <= lattice.height(); ++y) {
        for (int x = -1; x <= lattice.width(); ++x) {
          LatticeCandidate candidate{0, panel, rotation, y, x};
          candidate.cost = matcher.exact_cost(patch, candidate, best.cost);
          if (candidate < best && matcher.admits(patch, candidate)) best = candidate;
        }
      }
    }
  }
  if (best.cost == std::numeric_limits<double>::infinity()) return std::nullopt;
  return best;
}

struct Case {
  std::string name;
  PlanOptions options;
  std::vector<Artwork> artworks;
  std::vector<StockPanel> stock;
  test::ShapeOf shape_of = nullptr;  // else squares
};

// Places every patch by the matcher and asks the exhaustive search for each.
void expect_exhaustive_choices(const Case& it, std::size_t most = 1000) {
  SCOPED_TRACE(it.name);
  auto problem = make_problem(it.artworks, it.stock, it.options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  if (it.shape_of) test::reshape(*problem, it.shape_of);
  CertifiedMatcher matcher(std::move(problem->panels), turns(it.options.rotations), problem->classes,
                           problem->entries_per_unit);
  ASSERT_TRUE(matcher.build_index(1, {}).ok());
  std::size_t placed = 0;
  for (const Problem::Task& task : problem->queue) {
    if (placed++ == most) break;
    const auto expected = exhaustive(matcher, task.match, it.options.rotations);
    const auto found = *matcher.best(task.match, {});
    ASSERT_EQ(found.has_value(), expected.has_value()) << "patch " << placed;
    if (!found) continue;
    ASSERT_EQ(*found, *expected) << "patch " << placed << ": cost " << found->cost << " against " << expected->cost;
    matcher.take(task.match, *found);
  }
}

// The same with matching in the spectrum as the judge, which larger panels and patches allow.
void expect_choices_of_the_oracle(const Case& it, std::size_t most) {
  SCOPED_TRACE(it.name);
  auto problem = make_problem(it.artworks, it.stock, it.options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  if (it.shape_of) test::reshape(*problem, it.shape_of);
  CertifiedMatcher matcher(std::move(problem->panels), turns(it.options.rotations), problem->classes,
                           problem->entries_per_unit);
  ASSERT_TRUE(matcher.build_index(1, {}).ok());
  test::ExhaustiveMatching oracle(matcher.panels(), turns(it.options.rotations), 1);
  for (std::size_t i = 0; i < std::min(most, problem->queue.size()); ++i) {
    const MatchPatch& patch = problem->queue[i].match;
    const auto expected = oracle.best(patch).best;
    const auto found = *matcher.best(patch, {});
    ASSERT_EQ(found.has_value(), expected.has_value()) << "patch " << i;
    EXPECT_EQ(found, expected) << "patch " << i;
    if (found) matcher.take(patch, *found);
  }
}

PlanOptions options(double patch_mm, double dpi, int rotations) {
  PlanOptions out;
  out.patch = Millimetres(patch_mm), out.dpi = dpi, out.rotations = rotations, out.threads = 1;
  return out;
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoes) {
  // 16 pixels a patch, one panel.
  expect_exhaustive_choices(
      {"plain", options(8, 50.8, 5), {blob_artwork("A", 40, 30, 24_mm, 1)}, {wood_panel("P", 90, 70, 50.8, 2)}});
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoesOnSeveralPanelsOfOtherResolution) {
  Case it{"two panels", options(9, 50.8, 4), {blob_artwork("A", 60, 50, 27_mm, 3)}, {}};
  it.stock = {wood_panel("P", 100, 60, 75, 4), wood_panel("Q", 70, 80, 50.8, 5)};
  it.stock[0].picture.origin = it.stock[0].free.origin = point<PanelFrame>(3.3, -7.1);
  expect_exhaustive_choices(it, 5);
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoesUntilTheWoodIsGone) {
  expect_exhaustive_choices(
      {"scarce", options(8, 50.8, 3), {blob_artwork("A", 40, 40, 48_mm, 6)}, {wood_panel("P", 60, 50, 50.8, 7)}});
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoesWithOddSizesAndOneChannel) {
  Case it{"odd", options(7.3, 61, 2), {blob_artwork("A", 50, 37, 22.7_mm, 8)}, {wood_panel("P", 80, 75, 61, 9)}};
  it.options.w_edge = 0;
  expect_exhaustive_choices(it);
  it.options.w_edge = 0.9, it.options.w_intensity = 0.05;
  expect_exhaustive_choices(it);
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoesForTinyPatches) {
  expect_exhaustive_choices(
      {"tiny", options(3, 40, 3), {blob_artwork("A", 20, 20, 9_mm, 10)}, {wood_panel("P", 40, 40, 40, 11)}});
}

TEST(Matcher, ChoosesAsExhaustiveSearchDoesForSeveralPicturesWithOtherPatches) {
  Case it{"pictures",
          options(8, 50.8, 3),
          {blob_artwork("A", 40, 40, 16_mm, 12), blob_artwork("B", 40, 30, 20_mm, 13)},
          {}};
  it.stock = {wood_panel("P", 100, 60, 50.8, 14)};
  expect_exhaustive_choices(it);
}

TEST(Matcher, PlacesAreTheBestOnesThatAreNotAlike) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 8_mm, 18)};
  const std::vector<StockPanel> stock{wood_panel("P", 70, 60, 50.8, 19)};
  auto problem = make_problem(artworks, stock, options(8, 50.8, 3));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  CertifiedMatcher matcher(std::move(problem->panels), turns(3), problem->classes, problem->entries_per_unit);
  ASSERT_TRUE(matcher.build_index(1, {}).ok());
  const MatchPatch& patch = problem->queue.front().match;
  const auto found = *matcher.candidates(patch, 6, {});
  ASSERT_EQ(found.size(), 6U);
  EXPECT_EQ(found.front(), **matcher.best(patch, {}));
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_TRUE(matcher.admits(patch, found[i]));
    EXPECT_EQ(found[i].cost, matcher.exact_cost(patch, found[i]));
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_LE(found[j].cost, found[i].cost);
      EXPECT_FALSE(matcher.alike(patch, found[i], found[j]));
    }
  }
  // There are no more than fit side by side.
  EXPECT_LT(matcher.candidates(patch, 1000, {})->size(), 100U);
}

TEST(Matcher, EqualWoodIsDecidedByPanelRotationRowAndColumn) {
  // Flat wood: every place costs the same, so the first of all must win.
  Case it{"flat", options(6, 50.8, 4), {blob_artwork("A", 30, 30, 12_mm, 15)}, {wood_panel("P", 50, 40, 50.8, 16)}};
  it.stock[0].picture.pixels.setTo(cv::Scalar(90, 120, 150));
  expect_exhaustive_choices(it);
}

TEST(ExhaustiveMatching, ChoosesAsLookingAtEveryPlaceDoes) {
  const PlanOptions o = options(8, 50.8, 5);
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 24_mm, 1)};
  const std::vector<StockPanel> stock{wood_panel("P", 90, 70, 50.8, 2), wood_panel("Q", 50, 60, 60, 3)};
  auto problem = make_problem(artworks, stock, o);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  CertifiedMatcher matcher(std::move(problem->panels), turns(5), problem->classes, problem->entries_per_unit);
  test::ExhaustiveMatching oracle(matcher.panels(), turns(5), 2);
  for (std::size_t i = 0; i < 4; ++i) {
    const MatchPatch& patch = problem->queue[i].match;
    const auto expected = exhaustive(matcher, patch, 5);
    ASSERT_TRUE(expected);
    EXPECT_EQ(oracle.best(patch).best, expected) << "patch " << i;
  }
}

TEST(ExhaustiveMatching, ChoosesAsLookingAtEveryPlaceDoesForOtherShapes) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 24_mm, 1)};
  const std::vector<StockPanel> stock{wood_panel("P", 90, 70, 50.8, 2)};
  auto problem = make_problem(artworks, stock, options(8, 50.8, 5));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  test::reshape(*problem, [](std::size_t i) { return i % 2 == 0 ? test::triangle(i / 2) : test::meander(i / 2); });
  CertifiedMatcher matcher(std::move(problem->panels), turns(5), problem->classes, problem->entries_per_unit);
  test::ExhaustiveMatching oracle(matcher.panels(), turns(5), 2);
  ASSERT_TRUE(matcher.build_index(1, {}).ok());
  for (std::size_t i = 0; i < 4; ++i) {
    const MatchPatch& patch = problem->queue[i].match;
    const auto expected = exhaustive(matcher, patch, 5);
    ASSERT_TRUE(expected);
    EXPECT_EQ(oracle.best(patch).best, expected) << "patch " << i;
    if (i % 2 == 0) matcher.take(patch, *expected);
  }
}

TEST(ExhaustiveMatching, FindsNoPlaceWhereThereIsNone) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 10_mm, 1)};
  std::vector<StockPanel> stock{wood_panel("P", 60, 60, 50.8, 2)};
  stock[0].free.pixels.setTo(0);
  stock[0].free.pixels(cv::Rect(10, 10, 12, 40)).setTo(255);  // narrower than a patch
  auto problem = make_problem(artworks, stock, options(10, 50.8, 3));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  test::ExhaustiveMatching oracle(problem->panels, turns(3), 1);
  EXPECT_FALSE(oracle.best(problem->queue[0].match).best);
}

TEST(Matcher, ChoosesAsTheOracleDoesForLargePatches) {
  expect_choices_of_the_oracle(
      {"48 px", options(12, 101.6, 7), {blob_artwork("A", 60, 50, 48_mm, 20)}, {wood_panel("P", 300, 260, 101.6, 21)}},
      8);
  expect_choices_of_the_oracle(
      {"120 px", options(30, 101.6, 4), {blob_artwork("A", 60, 50, 60_mm, 22)}, {wood_panel("P", 400, 300, 101.6, 23)}},
      4);
}

// Small panels with holes, up to the panel's border, until the wood is gone.
TEST(Matcher, ChoosesAsExhaustiveSearchDoesForOtherShapes) {
  const std::vector<std::pair<std::string, test::ShapeOf>> shapes{{"discs", test::disc},
                                                                  {"triangles", test::triangle},
                                                                  {"Ls", test::ell},
                                                                  {"crescents", test::crescent},
                                                                  {"meanders", test::meander}};
  std::uint64_t seed = 40;
  for (const auto& [name, shape_of] : shapes) {
    expect_exhaustive_choices({name,
                               options(8, 50.8, 3),
                               {blob_artwork("A", 40, 40, 24_mm, seed)},
                               {wood_panel("P", 44, 40, 50.8, seed + 1), wood_panel("Q", 36, 33, 50.8, seed + 2)},
                               shape_of});
    seed += 3;
  }
}

// What is free is everywhere, so windows reach beyond the panel with their empty corners.
TEST(Matcher, ChoosesAsExhaustiveSearchDoesForShapesAtThePanelsBorder) {
  Case it{"triangles", options(12, 50.8, 8), {blob_artwork("A", 40, 30, 24_mm, 24)}, {}, test::triangle};
  it.stock = {wood_panel("P", 70, 60, 50.8, 25)};
  it.stock[0].free.pixels.setTo(255);
  expect_exhaustive_choices(it);
}

TEST(Matcher, ChoosesAsTheOracleDoesForLargeShapes) {
  const std::vector<StockPanel> stock{wood_panel("P", 260, 200, 101.6, 61), wood_panel("Q", 150, 240, 101.6, 62)};
  expect_choices_of_the_oracle({"mixed",
                                options(12, 101.6, 7),
                                {blob_artwork("A", 60, 50, 36_mm, 60)},
                                stock,
                                [](std::size_t i) {
                                  return i % 4 == 0   ? test::ell(i / 4)
                                         : i % 4 == 1 ? test::disc(i)
                                         : i % 4 == 2 ? test::crescent(i / 4)
                                                      : test::meander(i / 4);
                                }},
                               12);
}

RC_GTEST_PROP(MatcherOfSeed, ChoosesAsTheOracleDoesForStars, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1 << 20);
  RC_LOG() << "seed " << seed;
  const int rotations = *rc::gen::inRange(1, 4);
  expect_choices_of_the_oracle({"stars",
                                options(9, 50.8, rotations),
                                {blob_artwork("A", 40, 40, 27_mm, seed)},
                                {wood_panel("P", 60, 50, 50.8, seed + 1), wood_panel("Q", 45, 40, 50.8, seed + 2)},
                                [&](std::size_t i) { return test::star(seed + i); }},
                               3);
  RC_ASSERT(!::testing::Test::HasFailure());
}

TEST(Matcher, FindsTheCopyOfThePictureInTheWood) {
  const StockPanel panel = wood_panel("P", 120, 90, 50.8, 17);
  Artwork artwork;
  artwork.name = "copy", artwork.letter = "A";
  artwork.picture = panel.picture.pixels(cv::Rect(30, 40, 16, 16)).clone();
  artwork.width = artwork.height = 8_mm;
  PlanOptions o = options(8, 50.8, 6);
  o.w_hist = 0, o.w_edge = 0, o.exact = true;
  const auto plan = make_plan(std::span(&artwork, 1), std::span(&panel, 1), o);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_TRUE(plan->pieces[0].placement);
  EXPECT_NEAR(plan->pieces[0].cost, 0, 1e-9);
  EXPECT_NEAR(plan->pieces[0].panel_outline()[0].x.count(), 15, 1e-9);
  EXPECT_NEAR(plan->pieces[0].panel_outline()[0].y.count(), (90 - 56) / 2.0, 1e-9);
}

}  // namespace
}  // namespace veneer::planner
