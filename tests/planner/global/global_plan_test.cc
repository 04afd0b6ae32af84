#include "planner/global/global_plan.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "base/polygon_ops.h"
#include "planner/files/plan_files.h"
#include "planner/global/global_journal.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/free_wood.h"
#include "planner/poses/footprint.h"
#include "planner/problem/priority.h"
#include "tests/support/small_plans.h"
#include "tests/support/stop_in_the_midst.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::planned;
using test::StopInTheMidst;
using test::wood_panel;

PlanOptions global_options() {
  PlanOptions options = test::small_options_without_saliency();
  options.optimize = Optimize::kGlobal;
  return options;
}

PlanOptions greedy(PlanOptions options) {
  options.optimize = Optimize::kGreedy;
  return options;
}

// What matters in a picture: its left half so much, the rest so much.
cv::Mat left_half(int left, int right) {
  cv::Mat out(40, 40, CV_8UC1, cv::Scalar(right));
  out(cv::Rect(0, 0, 20, 40)).setTo(left);
  return out;
}

double weighed_cost(const Plan& plan, const Artwork& artwork) {
  std::vector<Patch> patches;
  for (const Piece& piece : plan.pieces) patches.push_back({piece.row, piece.column, piece.artwork_outline});
  const std::vector<double> weights = importances(artwork, patches);
  double out = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) out += weights[i] * plan.pieces[i].cost;
  return out;
}

void expect_to_keep_to_the_wood(const Plan& plan, const std::vector<StockPanel>& stock, const PlanOptions& options) {
  for (const StockPanel& panel : stock) {
    FreeWood wood(panel.free, options.kerf, options.position_margin);
    std::vector<Region<PanelFrame>> allocations;
    for (const Piece& piece : plan.pieces) {
      if (!piece.placement || piece.placement->panel != panel.id) continue;
      EXPECT_TRUE(wood.on_free_wood(piece.panel_outline()));
      allocations.push_back(offset(Region<PanelFrame>(piece.panel_outline()), options.kerf));
    }
    for (std::size_t i = 0; i < allocations.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) EXPECT_TRUE(!overlaps(allocations[i], allocations[j]));
  }
}

class GlobalPlanOfSeed : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(GlobalPlanOfSeed, IsNeverWorseThanGreedyAndKeepsToTheWood) {
  const std::uint64_t seed = GetParam();
  cv::RNG random(seed);
  PlanOptions options = global_options();
  options.kerf = Millimetres(random.uniform(0, 50) / 100.0);
  options.position_margin = Millimetres(random.uniform(0, 3) / 10.0);
  options.rotations = random.uniform(1, 8);
  options.patch = Millimetres(random.uniform(50, 110) / 10.0);
  options.optimize_iterations = 5000;
  const std::vector<StockPanel> stock{wood_panel("P", 90, 70, 50.8, seed), wood_panel("Q", 60, 60, 45, seed + 9)};
  std::vector<Artwork> artworks{blob_artwork("A", 40, 40, Millimetres(random.uniform(20, 60)), seed + 1)};
  if (seed % 2 == 0) artworks[0].importance = left_half(240, 20);
  const Plan plan = planned(artworks, stock, options), before = planned(artworks, stock, greedy(options));
  ASSERT_TRUE(plan.global.has_value());
  EXPECT_EQ(plan.global->greedy_unfilled, unfilled(before));
  const double cost_before = weighed_cost(before, artworks[0]), cost = weighed_cost(plan, artworks[0]);
  EXPECT_NEAR(plan.global->greedy_cost, cost_before, 1e-9 * cost_before);
  EXPECT_NEAR(plan.global->cost, cost, 1e-9 * cost);
  EXPECT_TRUE(unfilled(plan) <= unfilled(before));
  EXPECT_TRUE(unfilled(plan) < unfilled(before) || cost <= cost_before * (1 + 1e-12));
  expect_to_keep_to_the_wood(plan, stock, options);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GlobalPlanOfSeed, ::testing::Range<std::uint64_t>(1, 13));

// Cells of unlike shapes and sizes, none of which is convex.
TEST(GlobalPlan, OfFreeCellsIsBetterThanGreedyAndKeepsToTheWood) {
  const std::vector<StockPanel> stock{wood_panel("P", 150, 110, 50.8, 2)};
  PlanOptions options = global_options();
  options.layout = LayoutKind::kMosaic, options.optimize_iterations = 20000;
  const Plan plan = planned({blob_artwork("A", 50, 50, 42_mm, 1)}, stock, options);
  ASSERT_TRUE(plan.global.has_value());
  EXPECT_EQ(unfilled(plan), 0U);
  EXPECT_LT(plan.global->cost, 0.98 * plan.global->greedy_cost);
  expect_to_keep_to_the_wood(plan, stock, options);
}

TEST(GlobalPlan, GainsWhereWoodIsScarce) {
  const std::vector<StockPanel> stock{wood_panel("P", 150, 110, 50.8, 2)};
  PlanOptions options = global_options();
  options.optimize_iterations = 50000;
  const Plan plan = planned({blob_artwork("A", 50, 50, 42_mm, 1)}, stock, options);
  EXPECT_EQ(unfilled(plan), 0U);
  EXPECT_LT(plan.global->cost, 0.97 * plan.global->greedy_cost);
}

TEST(GlobalPlan, GivesTheBetterWoodToWhatIsImportant) {
  const std::vector<StockPanel> stock{wood_panel("P", 130, 110, 50.8, 2)};
  Artwork artwork = blob_artwork("A", 50, 50, 42_mm, 1);
  PlanOptions options = global_options();
  options.optimize_iterations = 50000;
  const auto cost_of_left = [](const Plan& plan) {
    double cost = 0;
    for (const Piece& piece : plan.pieces)
      if (piece.column < 3) cost += piece.cost;
    return cost;
  };
  const Plan alike = planned({artwork}, stock, options);
  artwork.importance = left_half(255, 25);
  const Plan plan = planned({artwork}, stock, options);
  ASSERT_EQ(unfilled(alike) + unfilled(plan), 0U);
  EXPECT_LT(cost_of_left(plan), 0.97 * cost_of_left(alike));
  EXPECT_GT(cost_total(plan), cost_total(alike));
}

TEST(GlobalPlan, FillsEveryPatchOnAThirdMoreWoodThanThePicture) {
  // Room for 8 x 6 patches of 7.3 mm and little more; greedy jams.
  StockPanel panel = wood_panel("P", 120, 90, 50.8, 2);
  panel.free.pixels = cv::Mat(90, 120, CV_8UC1, cv::Scalar(255));
  PlanOptions options = global_options();
  options.rotations = 15, options.optimize_iterations = 20000;
  const std::vector<Artwork> artworks{blob_artwork("A", 70, 60, 42_mm, 1)};
  const Plan plan = planned(artworks, {panel}, options), before = planned(artworks, {panel}, greedy(options));
  ASSERT_GT(unfilled(before), 0U);
  EXPECT_EQ(unfilled(plan), 0U);
  double where_greedy_placed = 0;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i)
    if (before.pieces[i].placement) where_greedy_placed += plan.pieces[i].cost;
  EXPECT_LE(where_greedy_placed, cost_total(before));
}

TEST(GlobalPlan, AWholeRunUsesItsWholeBudget) {
  const std::vector<StockPanel> stock{wood_panel("P", 90, 70, 50.8, 2)};
  const Plan plan = planned({blob_artwork("A", 50, 50, 21_mm, 1)}, stock, global_options());
  EXPECT_EQ(plan.global->iterations, plan.global->budget);
  EXPECT_FALSE(plan.global->stopped);
}

TEST(GlobalPlan, IsTheSameForAnyNumberOfThreadsAndAnotherForAnotherSeed) {
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 2), wood_panel("Q", 70, 90, 50.8, 3)};
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 40, 35_mm, 1)};
  PlanOptions options = global_options();
  options.optimize_iterations = 20000;
  const std::string one = plan_to_json(planned(artworks, stock, options));
  EXPECT_EQ(plan_to_json(planned(artworks, stock, options)), one);
  options.threads = 3;
  EXPECT_EQ(plan_to_json(planned(artworks, stock, options)), one);
  options.threads = 1, options.seed = 2;
  EXPECT_NE(plan_to_json(planned(artworks, stock, options)), one);
}

TEST(GlobalPlan, AStoppedRunGivesTheBestSoFarAndIsRepeatedByItsIterations) {
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 2)};
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 40, 35_mm, 1)};
  PlanOptions options = global_options();
  options.optimize_iterations = 30000;
  const Plan plan = planned(artworks, stock, options);
  EXPECT_TRUE(plan.global->stopped);
  EXPECT_EQ(plan.global->iterations, 30000U);
  EXPECT_TRUE(plan.global->unfilled < plan.global->greedy_unfilled || plan.global->cost < plan.global->greedy_cost);
}

// The optimisation alone, whose progress is told often.
class GlobalChoice {
 public:
  explicit GlobalChoice(PlanOptions options, const StockPanel& panel = wood_panel("P", 110, 90, 50.8, 2),
                        const Artwork& artwork = blob_artwork("A", 50, 40, 35_mm, 1))
      : options_(std::move(options)), problem_(problem(panel, artwork)), matcher_(matcher()) {
    if (!matcher_.build_index(1, {}).ok()) throw std::runtime_error("the wood was not indexed");
    for (const Problem::Task& task : problem_.queue) {
      greedy_.push_back(*matcher_.best(task.match, {}));
      if (greedy_.back()) matcher_.take(task.match, *greedy_.back());
    }
  }
  GlobalOutcome run(
      std::uint64_t iterations, const GlobalProgress& progress = [](double, const std::string&) {},
      const std::stop_token& stop = {}, PlanJournal* journal = nullptr) {
    PlanOptions options = options_;
    options.optimize_iterations = iterations;
    return *plan_globally(problem_, matcher_, greedy_, options, 1, progress, stop, journal, nullptr,
                          OnStop::kBestSoFar);
  }
  PatchPlacements greedy() const { return placements_of(problem_, matcher_, greedy_); }
  // Each in its turn.
  bool admits_all(const PatchPlacements& patches) const {
    std::vector<FreeWood> wood;
    for (const MatchPanel& panel : matcher_.panels()) wood.push_back(panel.wood.untouched());
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (!patches[i]) continue;
      const auto outline = patches[i]->panel_from_artwork * problem_.queue[i].match.outline;
      FreeWood& there = wood[static_cast<std::size_t>(patches[i]->panel)];
      if (!there.admits(outline)) return false;
      there.allocate(outline);
    }
    return true;
  }

 private:
  Problem problem(const StockPanel& panel, const Artwork& artwork) const {
    auto made = make_problem({&artwork, 1}, {&panel, 1}, options_);
    if (!made.ok()) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  CertifiedMatcher matcher() {
    return {std::move(problem_.panels), turns(options_.rotations), problem_.classes, problem_.entries_per_unit};
  }

  PlanOptions options_;
  Problem problem_;
  CertifiedMatcher matcher_;
  std::vector<std::optional<LatticeCandidate>> greedy_;
};

void expect_same(const PatchPlacements& a, const PatchPlacements& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].has_value(), b[i].has_value());
    if (!a[i]) continue;
    EXPECT_EQ(a[i]->panel, b[i]->panel);
    const auto at = point<ArtworkFrame>(3, 5), far = point<ArtworkFrame>(90, 70);
    EXPECT_EQ(a[i]->panel_from_artwork * at, b[i]->panel_from_artwork * at);
    EXPECT_EQ(a[i]->panel_from_artwork * far, b[i]->panel_from_artwork * far);
  }
}

// Once patches choose together; by then greedy's plan is there.
TEST(GlobalPlan, IsNoneOnceItIsStoppedUnlessTheBestSoFarIsAskedFor) {
  std::vector<StockPanel> stock{wood_panel("P", 160, 140, 50.8, 2)};
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 40, 35_mm, 1)};
  const auto stopped_at = [&](std::string_view doing, const PlanOptions& options, OnStop on_stop) {
    std::stop_source stop;
    return make_plan(
        artworks, stock, options,
        [&](double, std::string_view text) {
          if (text.starts_with(doing)) stop.request_stop();
        },
        stop.get_token(), nullptr, nullptr, on_stop);
  };
  PlanOptions options = global_options();
  options.fine_rotation = true, options.alternatives = 2;
  for (const std::string_view doing : {"surveying", "optimising", "turning pieces finely"}) {
    const auto none = stopped_at(doing, options, OnStop::kCancel);
    ASSERT_FALSE(none.ok()) << doing;
    EXPECT_EQ(none.error().code, ErrorCode::kCancelled);
    const auto best = stopped_at(doing, options, OnStop::kBestSoFar);
    ASSERT_TRUE(best.ok()) << best.error().message;
    EXPECT_EQ(best->global->stopped, doing != "turning pieces finely");
    EXPECT_EQ(best->warnings,
              (std::vector<std::string>{"not all pieces are turned finely, because planning was stopped",
                                        "no alternatives of the pieces are listed, because planning was stopped"}))
        << doing;
  }
  options = global_options(), options.refine = Refine::kDp;
  EXPECT_FALSE(stopped_at("refining borders", options, OnStop::kCancel).ok());
  const auto best = stopped_at("refining borders", options, OnStop::kBestSoFar);
  ASSERT_TRUE(best.ok()) << best.error().message;
  EXPECT_EQ(best->refined->cost, best->refined->cost_before) << "nothing was cut yet";
  EXPECT_EQ(best->warnings,
            (std::vector<std::string>{"borders are not refined to the end, because planning was stopped"}));
  // Where wood is missing, that is told, but not what is left.
  stock = {wood_panel("P", 110, 90, 50.8, 2)}, options = global_options();
  const auto scarce = stopped_at("optimising", options, OnStop::kBestSoFar);
  ASSERT_TRUE(scarce.ok()) << scarce.error().message;
  ASSERT_TRUE(scarce->shortage.has_value());
  EXPECT_EQ(scarce->shortage->unfilled, unfilled(*scarce));
  EXPECT_FALSE(scarce->shortage->left.has_value());
  EXPECT_EQ(scarce->warnings.back(), "what wood is left is not told, because planning was stopped");
}

TEST(GlobalPlan, AStopAtAnyMomentIsRepeatedByItsIterations) {
  GlobalChoice choice(global_options());
  std::stop_source stop;
  const GlobalOutcome outcome = choice.run(
      0,
      [&](double share, const std::string&) {
        if (share > 0.6) stop.request_stop();
      },
      stop.get_token());
  ASSERT_TRUE(outcome.report.stopped);
  ASSERT_GT(outcome.report.iterations, 0U);
  expect_same(choice.run(outcome.report.iterations).patches, outcome.patches);
}

// Shares of the whole run's own work, so the machine's speed and its other work do not matter. Of three stops at the
// same moment the least disturbed: processor time has outliers where a machine is shared, and AddressSanitizer gives
// back what was freed long ago in the time of whoever frees next.
void expect_to_stop_at_once(GlobalChoice& choice, std::uint64_t iterations) {
  const auto none = [](double, const std::string&) {};
  double whole = 0;
  {
    const StopInTheMidst never(1e6);
    const double before = never.now();
    choice.run(iterations, none);
    whole = never.now() - before;
  }
  constexpr int kMoments = 10;
  int stopped = 0;
  for (int k = 0; k < kMoments; ++k) {
    double least = whole;
    bool met = false;
    for (int attempt = 0; attempt < 3 && least >= 0.03 * whole; ++attempt) {
      const StopInTheMidst stop(whole * k / kMoments);
      choice.run(iterations, none, stop.token());
      least = std::min(least, stop.spent());
      met = met || stop.token().stop_requested();
    }
    stopped += met ? 1 : 0;
    EXPECT_LT(least, 0.03 * whole) << "after " << k << " of " << kMoments << " parts of the work";
  }
  EXPECT_GT(stopped, kMoments / 2);
}

TEST(GlobalPlan, DoesHardlyAnythingMoreOnceItIsStoppedOnScarceWood) {
  PlanOptions options = global_options();
  options.patch = 4_mm;
  GlobalChoice choice(options, wood_panel("P", 140, 40, 50.8, 2), blob_artwork("A", 50, 40, 28_mm, 1));
  ASSERT_GT(choice.run(1).report.greedy_unfilled, 0U);  // so the wood is packed too
  expect_to_stop_at_once(choice, 10000);
}

TEST(GlobalPlan, DoesHardlyAnythingMoreOnceItIsStoppedOnALongBoard) {
  PlanOptions options = global_options();
  options.patch = 4_mm;
  // Eight rows of regions: a single one would be too much.
  GlobalChoice choice(options, wood_panel("P", 600, 44, 50.8, 2), blob_artwork("A", 50, 40, 24_mm, 1));
  expect_to_stop_at_once(choice, 3000);
}

TEST(GlobalPlan, LeavesHolesToThePatchesThatMatterLeast) {
  // Wood for two thirds of the patches: many stay without whatever is done.
  GlobalChoice choice(global_options(), wood_panel("P", 110, 90, 50.8, 2), blob_artwork("A", 50, 40, 49_mm, 1));
  const PatchPlacements patches = choice.run(20000).patches;
  const auto holes = static_cast<std::size_t>(
      std::count_if(patches.begin(), patches.end(), [](const auto& placement) { return !placement.has_value(); }));
  ASSERT_GT(holes, 5U);
  ASSERT_LT(holes, patches.size() / 2);
  // Patches are in the order in which they choose: the first matter most.
  for (std::size_t i = 0; i + holes + holes / 2 < patches.size(); ++i) EXPECT_TRUE(patches[i].has_value()) << i;
}

TEST(GlobalPlan, AStopDuringTheSurveyLeavesGreedysPlan) {
  GlobalChoice choice(global_options());
  std::stop_source stop;
  const GlobalOutcome outcome = choice.run(
      0,
      [&](double, const std::string& text) {
        if (text.starts_with("surveying")) stop.request_stop();
      },
      stop.get_token());
  EXPECT_TRUE(outcome.report.stopped);
  EXPECT_EQ(outcome.report.iterations, 0U);
  expect_same(outcome.patches, choice.greedy());
}

TEST(GlobalPlan, GoesOnFromAJournalWithoutDoingAgainWhatWasDone) {
  const veneer::testing::TempDirectory folder;
  const auto journal = [&] { return std::move(*PlanJournal::open(folder.path() / "plan.journal", "key")); };
  GlobalChoice choice(global_options());
  const GlobalOutcome unbroken = choice.run(0);
  std::stop_source stop;
  PlanJournal first = journal();
  const GlobalOutcome stopped = choice.run(
      0,
      [&](double share, const std::string&) {
        if (share > 0.6) stop.request_stop();
      },
      stop.get_token(), &first);
  ASSERT_TRUE(stopped.report.stopped);

  PlanJournal second = journal();
  ASSERT_TRUE(second.goes_on());
  double lowest = 1;
  const GlobalOutcome gone_on = choice.run(
      0,
      [&](double share, const std::string& text) {
        lowest = std::min(lowest, share);
        EXPECT_TRUE(text.starts_with("optimising")) << text;
      },
      {}, &second);
  EXPECT_GT(lowest, 0.5);
  EXPECT_FALSE(gone_on.report.stopped);
  EXPECT_EQ(gone_on.report.cost, unbroken.report.cost);
  expect_same(gone_on.patches, unbroken.patches);
}

// The survey lists what it calls free. Should it err about one place, one patch goes without it, not all without
// theirs.
TEST(GlobalPlan, KeepsWhatOthersGainWhenOneIsRefusedItsWood) {
  const veneer::testing::TempDirectory folder;
  const auto journal = [&](const char* name) { return std::move(*PlanJournal::open(folder.path() / name, "key")); };
  GlobalChoice choice(global_options());
  {
    PlanJournal surveyed = journal("surveyed");
    choice.run(
        1, [](double, const std::string&) {}, {}, &surveyed);
  }
  PlanJournal surveyed = journal("surveyed");
  GlobalJournal known(&surveyed);
  GlobalSearch::Lists lists = **known.lists(choice.greedy().size(), {});
  GlobalSearch::State state = *known.next_state(lists);
  // At the panel's corner, which is no wood, for nothing: whatever else it may have, the first patch goes there.
  lists[0].insert(lists[0].begin(), {pose_at(0, 0.5, 0.5, 0), 0});
  for (auto* numbers : {&state.chosen, &state.best}) ++numbers->front();
  PlanJournal mistaken = journal("mistaken");
  GlobalJournal told(&mistaken);
  ASSERT_TRUE(told.add(lists, {}).ok());
  told.add(state);
  PlanJournal again = journal("mistaken");

  const GlobalOutcome outcome = choice.run(
      30000, [](double, const std::string&) {}, {}, &again);
  const GlobalReport& report = outcome.report;
  EXPECT_TRUE(report.unfilled < report.greedy_unfilled ||
              (report.unfilled == report.greedy_unfilled && report.cost < report.greedy_cost));
  EXPECT_TRUE(choice.admits_all(outcome.patches));
}

TEST(GlobalPlan, TheClockStopsItAfterWholeLegsThatIterationsRepeat) {
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 2)};
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 40, 35_mm, 1)};
  PlanOptions options = global_options();
  options.optimize_seconds = 1e-9;
  const Plan plan = planned(artworks, stock, options);
  EXPECT_TRUE(plan.global->stopped);
  ASSERT_GT(plan.global->iterations, 0U);
  options.optimize_seconds = 0, options.optimize_iterations = plan.global->iterations;
  EXPECT_EQ(plan_to_json(planned(artworks, stock, options)), plan_to_json(plan));
}

// What the fast test calls free, the rule of free_wood.h must admit; what it calls taken may only be closer than the
// slack.
RC_GTEST_PROP(Footprint, AgreesWithTheRuleOfFreeWood, ()) {
  const auto number = [](int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; };
  const Millimetres kerf(number(0, 1));
  const auto rectangle = [&] {
    const double w = number(2, 8), h = number(2, 8);
    return Ring<ArtworkFrame>{point<ArtworkFrame>(3, 5), point<ArtworkFrame>(3 + w, 5),
                              point<ArtworkFrame>(3 + w, 5 + h), point<ArtworkFrame>(3, 5 + h)};
  };
  const Ring<ArtworkFrame> a = rectangle(), b = rectangle();
  const double turn_a = number(0, 7), x = number(40, 60), y = number(40, 60), turn_b = number(0, 7);
  const Pose at_a = pose_at(0, 50, 50, turn_a), at_b = pose_at(0, x, y, turn_b);
  Raster<PanelFrame> free;
  free.pixels = cv::Mat(100, 100, CV_8UC1, cv::Scalar(255));
  free.resolution = ScanResolution{1};
  const auto taken = [&](Millimetres growth) {
    const Footprint fa(a, growth), fb(b, growth);
    return Footprint::overlap(fa, at_a, fb, at_b);
  };
  const Footprint shape_a(a, kerf), shape_b(b, kerf);
  FreeWood wood(free, kerf, Millimetres(0));
  wood.allocate(shape_a.panel_from_artwork(at_a) * a);
  const bool collides = wood.collides(shape_b.panel_from_artwork(at_b) * b);
  if (!taken(kerf + FreeWood::kSlack)) RC_ASSERT(!collides);
  if (taken(kerf)) RC_ASSERT(collides);
}

// The same of stars with notches, whose footprints are several convex parts and reach a little farther than the rule.
RC_GTEST_PROP(Footprint, OfAStarAgreesWithTheRuleOfFreeWood, ()) {
  const auto number = [](int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; };
  const auto star = [&] {
    Ring<ArtworkFrame> out;
    for (int k = 0; k < 9; ++k) {
      const double radius = number(2, 6), angle = 2 * CV_PI * k / 9;
      out.push_back(point<ArtworkFrame>(10 + radius * std::cos(angle), 10 + radius * std::sin(angle)));
    }
    return out;
  };
  const Ring<ArtworkFrame> a = star(), b = star();
  const Millimetres kerf(number(0, 1));
  const Footprint fa(a, kerf + FreeWood::kSlack), fb(b, kerf + FreeWood::kSlack);
  const Pose at_a = pose_at(0, 50, 50, number(0, 7)), at_b = pose_at(0, number(40, 60), number(40, 60), number(0, 7));
  Raster<PanelFrame> free;
  free.pixels = cv::Mat(100, 100, CV_8UC1, cv::Scalar(255));
  free.resolution = ScanResolution{1};
  const auto collides = [&](Millimetres growth) {
    FreeWood wood(free, growth, Millimetres(0));
    wood.allocate(fa.panel_from_artwork(at_a) * a);
    return wood.collides(fb.panel_from_artwork(at_b) * b);
  };
  const bool overlap = Footprint::overlap(fa, at_a, fb, at_b);
  RC_ASSERT(overlap == Footprint::overlap(fb, at_b, fa, at_a));
  // Notches that the kerf closes count as taken, so only what it leaves open has to agree.
  if (!overlap) RC_ASSERT(!collides(kerf));
  const bool open = offset(Region<ArtworkFrame>(a), kerf + 2 * Footprint::kConcaveSlack).rings().size() == 1 &&
                    offset(Region<ArtworkFrame>(b), kerf + 2 * Footprint::kConcaveSlack).rings().size() == 1;
  if (overlap && open) RC_ASSERT(collides(kerf + 2 * Footprint::kConcaveSlack));
}

}  // namespace
}  // namespace veneer::planner
