// The shortlist against the certified search, for odd shapes against the oracle, and what it promises by itself.
#include "planner/matching/shortlist_matcher.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "planner/matching/certified_matcher.h"
#include "planner/pictures/features.h"
#include "planner/problem/problem.h"
#include "tests/support/exhaustive_matching.h"
#include "tests/support/patch_shapes.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_panel;

PlanOptions options(double patch_mm, double dpi, int rotations) {
  PlanOptions out;
  out.patch = Millimetres(patch_mm), out.dpi = dpi, out.rotations = rotations, out.threads = 1;
  return out;
}

struct Tally {
  double shortlist = 0, certified = 0;
  int patches = 0, misses = 0;  // misses: more than a per mille above the cheapest place
};

// Both search the same wood for every patch; the shortlist's choice is taken.
void compare(const std::vector<Artwork>& artworks, const std::vector<StockPanel>& stock, const PlanOptions& o,
             Tally& tally) {
  auto problem = make_problem(artworks, stock, o);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  CertifiedMatcher certified(problem->panels, turns(o.rotations), problem->classes, problem->entries_per_unit);
  ShortlistMatcher shortlist(problem->panels, turns(o.rotations), problem->classes, largest_response(o));
  ASSERT_TRUE(certified.build_index(1, {}).ok());
  ASSERT_TRUE(shortlist.build_index(1, {}).ok());
  for (const Problem::Task& task : problem->queue) {
    const auto expected = *certified.best(task.match, {});
    const auto found = *shortlist.best(task.match, {});
    ASSERT_EQ(found.has_value(), expected.has_value()) << "a place is found whenever there is one";
    if (!found) continue;
    ASSERT_TRUE(shortlist.admits(task.match, *found));
    ASSERT_EQ(found->cost, shortlist.exact_cost(task.match, *found));
    ASSERT_GE(found->cost, expected->cost * (1 - 1e-9));
    ++tally.patches;
    tally.shortlist += found->cost, tally.certified += expected->cost;
    if (found->cost > expected->cost * 1.001) ++tally.misses;
    certified.take(task.match, *found);
    shortlist.take(task.match, *found);
  }
}

// Windows of 22 pixels, on wood whose stripes are as fine as the shortlist's blocks: harder than what is planned. In 60
// such scenes 63 of 2160 choices were misses, at most 7 of 36 in one scene; all together cost 1.0026 times the cheapest
// places, in the worst scene 1.029 times. In these six it is 6 of 216, and 1.0005 times.
TEST(ShortlistMatcher, MissesFewOfTheCheapestPlacesAndThoseByLittle) {
  Tally tally;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    compare({blob_artwork("A", 60, 60, 66_mm, seed)}, {wood_panel("P", 260, 220, 50.8, seed + 10)},
            options(11, 50.8, 5), tally);
  }
  EXPECT_EQ(tally.patches, 216);
  EXPECT_LE(tally.shortlist, 1.001 * tally.certified);
  EXPECT_LE(tally.misses, 6);  // as before: 3 of 108
}

// In 20 such scenes 7 of 611 choices were misses, at most two in one; all together cost 1.0001 times the cheapest
// places, in the worst scene 1.002 times.
TEST(ShortlistMatcher, HardlyEverMissesOnSeveralPanelsWithSeveralSizesAndOneChannel) {
  Tally tally;
  PlanOptions o = options(9, 61, 4);
  o.w_edge = 0;
  StockPanel other = wood_panel("Q", 120, 130, 75, 5);
  other.picture.origin = other.free.origin = point<PanelFrame>(3.3, -7.1);
  compare({blob_artwork("A", 40, 40, 36_mm, 3), blob_artwork("B", 50, 30, 31_mm, 4)},
          {wood_panel("P", 150, 140, 61, 6), other}, o, tally);
  EXPECT_LE(tally.shortlist, 1.001 * tally.certified);
  EXPECT_LE(tally.misses, 3);
}

TEST(ShortlistMatcher, FindsTheLastPlaces) {
  // Everything is used up: the last places are few and small.
  Tally tally;
  compare({blob_artwork("A", 40, 40, 48_mm, 6)}, {wood_panel("P", 60, 50, 50.8, 7)}, options(8, 50.8, 3), tally);
  EXPECT_GE(tally.patches, 3);
  EXPECT_LT(tally.patches, 36);
  EXPECT_EQ(tally.misses, 0);
}

TEST(ShortlistMatcher, FindsPlacesInStripsNarrowerThanACell) {
  // 48 pixels a patch, so cells of 4: strips leave 1 to 2 places across, and between two cells' middles.
  StockPanel panel = wood_panel("P", 150, 200, 50.8, 8);
  panel.free.pixels.setTo(0);
  panel.free.pixels(cv::Rect(11, 10, 51, 60)).setTo(255);
  panel.free.pixels(cv::Rect(78, 90, 60, 50)).setTo(255);
  Tally tally;
  PlanOptions o = options(24, 50.8, 4);
  o.kerf = Millimetres(0.1);
  compare({blob_artwork("A", 40, 40, 48_mm, 9)}, {panel}, o, tally);
  EXPECT_EQ(tally.patches, 2);
  EXPECT_EQ(tally.misses, 0);
}

TEST(ShortlistMatcher, TinyPatchesAreMatchedToo) {
  Tally tally;
  compare({blob_artwork("A", 20, 20, 9_mm, 10)}, {wood_panel("P", 40, 40, 40, 11)}, options(3, 40, 3), tally);
  EXPECT_GT(tally.patches, 0);
  EXPECT_EQ(tally.misses, 0);
}

// Several shapes of one class on two panels with holes, each judged by the oracle on the wood that is left.
void compare_with_the_oracle(const test::ShapeOf& shape_of, std::uint64_t seed, const PlanOptions& o, Tally& tally) {
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 50, 4 * o.patch, seed)};
  const std::vector<StockPanel> stock{wood_panel("P", 100, 90, o.dpi, seed + 1),
                                      wood_panel("Q", 70, 80, o.dpi, seed + 2)};
  auto problem = make_problem(artworks, stock, o);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  test::reshape(*problem, shape_of);
  ShortlistMatcher matcher(problem->panels, turns(o.rotations), problem->classes, largest_response(o));
  ASSERT_TRUE(matcher.build_index(1, {}).ok());
  test::ExhaustiveMatching oracle(matcher.panels(), turns(o.rotations), 1);
  for (const Problem::Task& task : problem->queue) {
    const auto expected = oracle.best(task.match).best;
    const auto found = *matcher.best(task.match, {});
    ASSERT_EQ(found.has_value(), expected.has_value()) << "a place is found whenever there is one";
    if (!found) continue;
    ASSERT_TRUE(matcher.admits(task.match, *found));
    ASSERT_EQ(found->cost, matcher.exact_cost(task.match, *found));
    ASSERT_GE(found->cost, expected->cost * (1 - 1e-9));
    ++tally.patches;
    tally.shortlist += found->cost, tally.certified += expected->cost;
    if (found->cost > expected->cost * 1.001) ++tally.misses;
    matcher.take(task.match, *found);
  }
}

// In 20 such scenes of each shape 5 of 1920 choices were misses, never two in one; in the worst they cost 1.0022 times
// the cheapest places.
TEST(ShortlistMatcher, ShapesAreMatchedByTheirOwnPixels) {
  const std::vector<std::pair<std::string, test::ShapeOf>> shapes{
      {"triangles", test::triangle}, {"discs", test::disc},       {"Ls", test::ell},
      {"crescents", test::crescent}, {"meanders", test::meander}, {"stars", test::star}};
  std::uint64_t seed = 100;
  for (const auto& [name, shape_of] : shapes) {
    SCOPED_TRACE(name);
    Tally tally;
    compare_with_the_oracle(shape_of, seed += 3, options(9, 50.8, 3), tally);
    EXPECT_GE(tally.patches, 12);
    EXPECT_LE(tally.shortlist, 1.001 * tally.certified);
    EXPECT_LE(tally.misses, 2);
  }
}

// A window may be larger than the class's smallest, and its outline leave the corner empty that the smallest lies in.
// Of triangles of 40 mm in wood 32 mm wide, some lie best with their longest side along the panel's edge.
TEST(ShortlistMatcher, FindsPlacesAtTheEdgeForTheLargerOfUnlikeWindows) {
  constexpr int kRotations = 8;
  PlanOptions o = options(40, 25.4, kRotations);
  o.kerf = Millimetres(0.01);
  StockPanel panel = wood_panel("P", 64, 64, 25.4, 4);
  panel.free.pixels(cv::Rect(32, 0, 32, 64)).setTo(0);
  auto problem =
      make_problem(std::vector<Artwork>{blob_artwork("A", 40, 40, 80_mm, 3)}, std::vector<StockPanel>{panel}, o);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  test::reshape(*problem, test::triangle);
  // As if others of the class were not half as wide and high.
  for (WindowClass& windows : problem->classes) {
    windows.width = windows.width * 5 / 11, windows.height = windows.height * 5 / 11;
    windows.least = static_cast<std::int64_t>(windows.width) * windows.height;
    windows.x = choose_blocks(windows.width), windows.y = choose_blocks(windows.height);
  }
  ShortlistMatcher shortlist(problem->panels, turns(kRotations), problem->classes, largest_response(o));
  CertifiedMatcher certified(problem->panels, turns(kRotations), problem->classes, problem->entries_per_unit);
  test::ExhaustiveMatching oracle(problem->panels, turns(kRotations), 1);
  for (Matcher* matcher : {static_cast<Matcher*>(&shortlist), static_cast<Matcher*>(&certified)}) {
    ASSERT_TRUE(matcher->build_index(1, {}).ok());
    for (const Problem::Task& task : problem->queue) {
      const auto expected = oracle.best(task.match).best;
      const auto found = *matcher->best(task.match, {});
      ASSERT_TRUE(expected.has_value());
      ASSERT_TRUE(found.has_value());
      EXPECT_LE(found->cost, expected->cost * 1.001);
    }
  }
}

// A spike is higher than the class's lowest window and than one of the panels, and no disc within its tip says so: what
// is looked at must still lie within what there is of the panel (seen by AddressSanitizer).
TEST(ShortlistMatcher, LooksAtNothingBelowAPanelThatIsLowerThanAPatch) {
  constexpr int kRotations = 2;
  PlanOptions o = options(40, 25.4, kRotations);
  o.kerf = Millimetres(0.01);
  const std::vector<StockPanel> stock{wood_panel("P", 64, 64, 25.4, 4), wood_panel("Q", 90, 26, 25.4, 5)};
  auto problem = make_problem(std::vector<Artwork>{blob_artwork("A", 40, 40, 40_mm, 3)}, stock, o);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  test::reshape(*problem, [](std::size_t) {
    return test::Shape{{0, 0}, {1, 0}, {1, 0.02}, {0.51, 0.03}, {0.505, 1}, {0.495, 1}, {0.49, 0.03}, {0, 0.02}};
  });
  for (WindowClass& windows : problem->classes) {
    windows.height = windows.height * 5 / 11;
    windows.y = choose_blocks(windows.height);
  }
  CertifiedMatcher certified(problem->panels, turns(kRotations), problem->classes, problem->entries_per_unit);
  test::ExhaustiveMatching oracle(problem->panels, turns(kRotations), 1);
  ASSERT_TRUE(certified.build_index(1, {}).ok());
  const MatchPatch& spike = problem->queue.front().match;
  const auto found = *certified.best(spike, {});
  ASSERT_TRUE(found.has_value());
  EXPECT_LE(found->cost, oracle.best(spike).best->cost * 1.001);
}

// Squares if `shape_of` is none.
void expect_different_places_in_order(const test::ShapeOf& shape_of) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 33_mm, 18)};
  const std::vector<StockPanel> stock{wood_panel("P", 170, 160, 50.8, 19)};
  auto problem = make_problem(artworks, stock, options(11, 50.8, 5));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  if (shape_of) test::reshape(*problem, shape_of);
  ShortlistMatcher matcher(std::move(problem->panels), turns(5), problem->classes, largest_response(PlanOptions{}));
  ASSERT_TRUE(matcher.build_index(2, {}).ok());
  for (const Problem::Task& task : problem->queue) {
    const auto found = *matcher.candidates(task.match, 8, {});
    ASSERT_EQ(found.size(), 8U);
    EXPECT_LE(found.front().cost, (*matcher.best(task.match, {}))->cost);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_TRUE(matcher.admits(task.match, found[i]));
      EXPECT_EQ(found[i].cost, matcher.exact_cost(task.match, found[i]));
      EXPECT_LE(found[i == 0 ? 0 : i - 1].cost, found[i].cost * (1 + 1e-3));
      for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(matcher.alike(task.match, found[i], found[j]));
    }
  }
}

// Not so everywhere yet: in one of three such scenes the first of several was 0.04 % dearer than best(), probably
// because its cell was dropped beside others alike.
TEST(ShortlistMatcher, PlacesAreFreeDifferentAndInOrder) {
  expect_different_places_in_order(nullptr);
  expect_different_places_in_order(test::ell);
}

TEST(ShortlistMatcher, FindsAHundredDifferentPlacesOnAmpleWood) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 33_mm, 18)};
  auto problem =
      make_problem(artworks, std::vector<StockPanel>{wood_panel("P", 400, 300, 50.8, 19)}, options(11, 50.8, 15));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  ShortlistMatcher matcher(std::move(problem->panels), turns(15), problem->classes, largest_response(PlanOptions{}));
  ASSERT_TRUE(matcher.build_index(2, {}).ok());
  for (const Problem::Task& task : problem->queue) EXPECT_EQ(matcher.candidates(task.match, 100, {})->size(), 100U);
}

TEST(ShortlistMatcher, StopsSoonAfterItIsAsked) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 30, 30_mm, 20)};
  const std::vector<StockPanel> stock{wood_panel("P", 900, 900, 50.8, 21)};
  auto problem = make_problem(artworks, stock, options(10, 50.8, 15));
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  ShortlistMatcher matcher(std::move(problem->panels), turns(15), problem->classes, largest_response(PlanOptions{}));
  std::stop_source stop;
  // Asked from within the first report of progress.
  const Status built = matcher.build_index(1, stop.get_token(), [&](double) { stop.request_stop(); });
  ASSERT_FALSE(built.ok());
  EXPECT_EQ(built.error().code, ErrorCode::kCancelled);
  EXPECT_LT(matcher.index_bytes(), 15U * 900 * 900) << "most of the index was not built";
}

}  // namespace
}  // namespace veneer::planner
