// One index for all that is asked of the same wood: measured once, its places found again.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "planner/files/plan_files.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/pictures/features.h"
#include "planner/problem/problem.h"
#include "planner/problem/shared_work.h"
#include "planner/series/series.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace {

// Blocks of memory of one size that were asked for since it was set.
std::atomic<std::size_t> g_watched_size = 0, g_asked_for = 0;

}  // namespace

// Not inlined, or the compiler sees only one of a pair and warns.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (size == g_watched_size) ++g_asked_for;
  if (void* block = std::malloc(size > 0 ? size : 1)) return block;
  throw std::bad_alloc();
}
// What must not throw is freed by the same delete.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (size == g_watched_size) ++g_asked_for;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }

namespace veneer::planner {
namespace {

using test::one_rotation_options;

class IndexReuse : public ::testing::Test {
 protected:
  Problem problem(const PlanOptions& options) const {
    auto made = make_problem({&artwork_, 1}, stock_, options);
    if (!made.ok()) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  std::string plan(const PlanOptions& options, SharedWork* shared = nullptr) const {
    const auto made = make_plan({&artwork_, 1}, stock_, options, {}, {}, nullptr, shared);
    if (!made.ok()) throw std::runtime_error(made.error().message);
    return plan_to_json(*made);
  }
  // Wood cannot be measured without the memory for what is found: how often a block of just that size is asked for.
  template <class Work>
  std::size_t measured(const Work& work) const {
    const Problem it = problem(one_rotation_options());
    const cv::Mat& panel = it.panels[0].features.pixels;
    const Lattice lattice(panel.cols, panel.rows, Radians(0));
    CoarseMap map(panel.size(), panel.channels(), lattice, cell_grid(it.classes.at(0)), it.classes[0].filled);
    g_asked_for = 0;
    g_watched_size = map.measured().front().size();
    work();
    g_watched_size = 0;
    return g_asked_for;
  }

  std::vector<StockPanel> stock_{test::wood_panel("P", 104, 100, 50.8, 3)};
  Artwork artwork_ = test::blob_artwork("A", 40, 40, 20_mm, 4);
};

// What the patches find one after another.
std::vector<std::optional<LatticeCandidate>> in_turn(Matcher& matcher, const Problem& problem) {
  std::vector<std::optional<LatticeCandidate>> out;
  for (const Problem::Task& task : problem.queue) {
    out.push_back(*matcher.best(task.match, {}));
    if (out.back()) matcher.take(task.match, *out.back());
  }
  return out;
}

TEST_F(IndexReuse, WoodThatIsGivenBackIsAsItWas) {
  PlanOptions options = one_rotation_options();
  options.rotations = 5;
  artwork_.width = artwork_.height = 45_mm;  // most of the wood
  const Problem it = problem(options);
  ShortlistMatcher shortlist(it.panels, turns(options.rotations), it.classes, largest_response(options));
  CertifiedMatcher certified(it.panels, turns(options.rotations), it.classes, it.entries_per_unit);
  for (Matcher* matcher : {static_cast<Matcher*>(&shortlist), static_cast<Matcher*>(&certified)}) {
    ASSERT_TRUE(matcher->build_index(1, {}).ok());
    const auto first = in_turn(*matcher, it);
    ASSERT_FALSE(*matcher->best(it.queue.front().match, {}) == first.front());
    ASSERT_TRUE(matcher->give_back(2, {}).ok());
    EXPECT_EQ(in_turn(*matcher, it), first);
  }
}

TEST_F(IndexReuse, AlternativesAreAskedOfTheIndexThatIsThere) {
  PlanOptions greedy = one_rotation_options(), global = greedy, fine = greedy;
  global.optimize = Optimize::kGlobal, global.optimize_iterations = 2000;
  fine.fine_rotation = true;
  for (PlanOptions options : {greedy, global, fine}) {
    const std::size_t once = measured([&] { plan(options); });
    ASSERT_GT(once, 0U);
    options.alternatives = 3;
    EXPECT_EQ(measured([&] { plan(options); }), once);
  }
}

TEST_F(IndexReuse, ASeriesMeasuresItsWoodOnce) {
  SeriesOptions how;
  how.pictures = 3;
  const std::size_t once = measured([&] { plan(one_rotation_options()); });
  ASSERT_GT(once, 0U);
  EXPECT_EQ(measured([&] { ASSERT_TRUE(make_series(artwork_, stock_, one_rotation_options(), how).ok()); }), once);
}

TEST_F(IndexReuse, PlansDoNotDependOnThePlanBefore) {
  SharedWork shared;
  const auto expect_same = [&](const PlanOptions& options) {
    const std::string alone = plan(options);
    EXPECT_EQ(plan(options, &shared), alone);
    EXPECT_EQ(plan(options, &shared), alone);
  };
  PlanOptions options = one_rotation_options();
  expect_same(options);
  options.alternatives = 2, options.fine_rotation = true;
  expect_same(options);
  options.kerf = 1_mm;
  expect_same(options);
  options.position_margin = 1_mm;
  expect_same(options);
  options.w_edge = 0.1;
  expect_same(options);
  options.rotations = 3;
  expect_same(options);
  options.exact = true;
  expect_same(options);
  options.patch = 4_mm;
  expect_same(options);
  stock_[0].free.pixels(cv::Rect(0, 0, 52, 100)).setTo(0);
  options.w_hist = 0;
  expect_same(options);
  cv::flip(stock_[0].picture.pixels, stock_[0].picture.pixels, 1);
  expect_same(options);
  stock_.push_back(test::wood_panel("Q", 60, 60, 50.8, 7));
  expect_same(options);
}

// What kept pieces hold is no less free for the next plan.
TEST_F(IndexReuse, WoodOfKeptPiecesIsNotLost) {
  SharedWork shared;
  const std::string alone = plan(one_rotation_options());
  const auto before = make_plan({&artwork_, 1}, stock_, one_rotation_options());
  PlanOptions keeping = one_rotation_options();
  for (const Piece& piece : before->pieces) keeping.kept.push_back({piece.mark, 1, piece.placement});
  for (std::size_t i = 0; i < keeping.kept.size(); i += 2) keeping.kept[i].placement.reset();
  plan(keeping, &shared);
  EXPECT_EQ(plan(one_rotation_options(), &shared), alone);
}

}  // namespace
}  // namespace veneer::planner
