// How much is still done after a stop request before the index stands: counted as processor time of the thread that
// works, as a share of what the whole takes, so the machine's speed and its other work do not matter.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "planner/boundaries/boundary_cuts.h"
#include "planner/boundaries/refinement.h"
#include "planner/edits/alternatives.h"
#include "planner/edits/kept_pieces.h"
#include "planner/files/plan_files.h"
#include "planner/global/candidate_survey.h"
#include "planner/global/global_plan.h"
#include "planner/global/packing.h"
#include "planner/greedy/greedy.h"
#include "planner/matching/certified_matcher.h"
#include "planner/matching/coarse_map.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/matching/window_samples.h"
#include "planner/parallel.h"
#include "planner/pictures/features.h"
#include "planner/pictures/histogram.h"
#include "planner/pictures/resample.h"
#include "planner/pictures/working_pictures.h"
#include "planner/poses/fine_rotation.h"
#include "planner/problem/problem.h"
#include "planner/problem/shortage.h"
#include "planner/problem/taken_wood.h"
#include "tests/support/stop_in_the_midst.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using test::StopInTheMidst;
using Work = std::function<void(const std::stop_token&)>;

double whole_of(const Work& work) {
  const StopInTheMidst never(1e6);
  const double before = never.now();
  work(never.token());
  return never.now() - before;
}

// Asks for a stop after `share` of the work: what is done after it, as a share of the whole. Timers are coarse, so the
// work may be over before: 0 then.
double rest_of(const Work& work, double share, double whole) {
  const StopInTheMidst stop(whole * share);
  work(stop.token());
  return stop.spent() / whole;
}

// What was stopped says so; what was over before is whole.
template <class Answer>
void expect_whole_or_cancelled(const Answer& answer) {
  EXPECT_TRUE(answer.ok() || answer.error().code == ErrorCode::kCancelled);
}

// Stages of a panel that is large enough for each to take some hundredths of a second.
class Stopping : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    panel_ = new StockPanel(test::wood_panel("P", 1800, 1400, 300, 1));
    // Like a scan of offcuts: much of it is not wood, with many borders.
    for (int i = 0; i < 120; ++i)
      cv::circle(panel_->free.pixels, {i * 577 % 1800, i * 919 % 1400}, 30, cv::Scalar(0), cv::FILLED);
  }
  static void TearDownTestSuite() { delete panel_; }
  static const StockPanel& panel() { return *panel_; }

  // Timers are coarse, so short work is done again and again until it is stopped; what is left counts as a share of
  // one.
  void expect_soon(const std::string& stage, const Work& work) {
    // The first time memory is made as well.
    const double once = std::min({whole_of(work), whole_of(work), whole_of(work)});
    const int times = std::max(1, static_cast<int>(0.08 / once));
    const Work often = [&](const std::stop_token& stop) {
      for (int i = 0; i < times && !stop.stop_requested(); ++i) work(stop);
    };
    // On the mean, and of three attempts the least disturbed: processor time has outliers where a machine is shared.
    // Work that heeds nothing has half of it left each time.
    double left = 0;
    int met = 0;
    for (int attempt = 0; attempt < 3; ++attempt) {
      left = 0, met = 0;
      for (int i = 1; i <= kMoments; ++i) {
        const double rest = rest_of(often, 0.1 * i, once * times) * times;
        left += rest;
        met += rest > 0 ? 1 : 0;
      }
      if (left < 0.2 * met + 1e-9) break;
    }
    EXPECT_LT(left, 0.2 * met + 1e-9) << stage;
    met_ += met, asked_ += kMoments;
  }
  void TearDown() override { EXPECT_GT(met_, asked_ / 2) << "most requests came while there was work"; }

 private:
  static constexpr int kMoments = 8;
  static inline StockPanel* panel_ = nullptr;
  int asked_ = 0, met_ = 0;
};

TEST_F(Stopping, PicturesAreReadInRows) {
  const cv::Mat& picture = panel().picture.pixels;
  const cv::Mat grey = grey_of(picture);
  PlanOptions options;
  options.w_colour = options.w_texture = 0.5, options.edge = 1_mm;
  GreyHistogram tones;
  tones.add(grey);
  expect_soon("grey", [&](const auto& stop) { expect_whole_or_cancelled(grey_of(picture, stop)); });
  expect_soon("tones",
              [&](const auto& stop) { expect_whole_or_cancelled(tones.add(grey, panel().free.pixels, 1, stop)); });
  expect_soon("matched tones",
              [&](const auto& stop) { expect_whole_or_cancelled(match_tones(grey, tones, 0.5, stop)); });
  expect_soon("resampling", [&](const auto& stop) { expect_whole_or_cancelled(stretch(picture, 1700, 1300, stop)); });
  expect_soon("filters", [&](const auto& stop) {
    expect_whole_or_cancelled(filter_bank({picture, grey, grey, panel().picture.resolution}, options, stop));
  });
}

TEST_F(Stopping, LatticesAreIndexedInRows) {
  PlanOptions options;
  options.patch = 4_mm, options.threads = 1, options.rotations = 1;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 12_mm, 3)};
  auto problem = make_problem(artworks, std::span(&panel(), 1), options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  const MatchPanel& wood = problem->panels.front();
  const WindowClass& windows = problem->classes.front();
  const cv::Mat& features = wood.features.pixels;
  const Lattice lattice(features.cols, features.rows, degrees(24));
  const BlockedPixels blocked = *blocked_pixels(wood.wood.raster(), 4_mm, {});
  const cv::Mat entries = *rounded_entries(features, 1000, {});
  const PlaceBits places = *PlaceBits::make(lattice, windows, wood.features, blocked, wood.wood.border(), {});
  CoarseMap map(features.size(), 2, lattice, cell_grid(windows), true);
  expect_soon("entries", [&](const auto& stop) { expect_whole_or_cancelled(rounded_entries(features, 1000, stop)); });
  expect_soon("blocked pixels",
              [&](const auto& stop) { expect_whole_or_cancelled(blocked_pixels(wood.wood.raster(), 4_mm, stop)); });
  expect_soon("places", [&](const auto& stop) {
    expect_whole_or_cancelled(PlaceBits::make(lattice, windows, wood.features, blocked, 0.2_mm, stop));
  });
  expect_soon("cells", [&](const auto& stop) { expect_whole_or_cancelled(map.measure(entries, lattice, stop)); });
  expect_soon("cells alive", [&](const auto& stop) {
    expect_whole_or_cancelled(map.find_alive(places, {0, 0, lattice.width(), lattice.height()}, stop));
  });
  expect_soon("bounds", [&](const auto& stop) { expect_whole_or_cancelled(map.find_bounds(stop)); });
  expect_soon("turned panel",
              [&](const auto& stop) { expect_whole_or_cancelled(RotatedPanel::make(features, lattice, 1000, stop)); });
  const RotatedPanel turned = *RotatedPanel::make(features, lattice, 1000, {});
  expect_soon("certified cells", [&](const auto& stop) {
    expect_whole_or_cancelled(CellIndex::make(turned, windows, wood.features, blocked, 0.2_mm, stop));
  });
}

// An answer that was begun and not finished is an error, and nothing that could be taken for a result.
TEST(Cancelled, IsWhatEveryStageAnswersOnceAStopIsRequested) {
  std::stop_source source;
  source.request_stop();
  const std::stop_token stop = source.get_token();
  const auto cancelled = [](const auto& answer) {
    return !answer.ok() && answer.error().code == ErrorCode::kCancelled;
  };
  PlanOptions options;
  options.patch = 4_mm, options.dpi = 50.8, options.rotations = 3, options.threads = 2;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 16_mm, 3)};
  const std::vector<StockPanel> stock{test::wood_panel("P", 100, 90, 50.8, 1)};
  const cv::Mat &picture = stock[0].picture.pixels, grey = grey_of(picture);
  GreyHistogram tones;
  tones.add(grey);
  const double counted = tones.total();
  EXPECT_TRUE(cancelled(grey_of(picture, stop)));
  EXPECT_TRUE(cancelled(tones.add(grey, {}, 1, stop)));
  EXPECT_EQ(tones.total(), counted) << "nothing of half a picture is counted";
  EXPECT_TRUE(cancelled(match_tones(grey, tones, 0.5, stop)));
  EXPECT_TRUE(cancelled(stretch(picture, 70, 60, stop)));
  EXPECT_TRUE(cancelled(at_resolution(stock[0].picture, ScanResolution::from_dpi(30), stop)));
  EXPECT_TRUE(cancelled(filter_bank({picture, grey, grey, stock[0].picture.resolution}, options, stop)));
  EXPECT_TRUE(cancelled(make_problem(artworks, stock, options, stop)));
  EXPECT_TRUE(cancelled(run_parallel(3, 2, stop, [](std::size_t) {})));

  auto problem = make_problem(artworks, stock, options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  for (const bool exact : {false, true}) {
    std::unique_ptr<Matcher> matcher;
    if (exact)
      matcher =
          std::make_unique<CertifiedMatcher>(problem->panels, turns(3), problem->classes, problem->entries_per_unit);
    else
      matcher =
          std::make_unique<ShortlistMatcher>(problem->panels, turns(3), problem->classes, largest_response(options));
    EXPECT_TRUE(cancelled(matcher->build_index(2, stop)));
  }
  ShortlistMatcher matcher(problem->panels, turns(3), problem->classes, largest_response(options));
  ASSERT_TRUE(matcher.build_index(2, {}).ok());
  const MatchPatch& patch = problem->queue.front().match;
  EXPECT_TRUE(cancelled(matcher.best(patch, stop)));
  EXPECT_TRUE(cancelled(matcher.candidates(patch, 3, stop)));
  EXPECT_TRUE(cancelled(place_in_turn(*problem, matcher, 2, stop, [](std::size_t) {})));
  std::vector<Footprint> footprints;
  for (const auto& task : problem->queue) footprints.emplace_back(task.match.outline, options.kerf + FreeWood::kSlack);
  EXPECT_TRUE(cancelled(survey_candidates(*problem, matcher, footprints, {}, {10, 2}, stop)));
  EXPECT_TRUE(cancelled(pack_rectangles(matcher, 4_mm, 4_mm, 16, 2, stop)));
  const BoundaryCuts cuts(*problem, matcher.panels(), {.limits = {}});
  const PatchPlacements nowhere(problem->queue.size());
  EXPECT_TRUE(cancelled(cuts.settled(nowhere, nowhere, stop)));
  EXPECT_TRUE(cancelled(shortage_of(*problem, matcher, nowhere, options.patch, {}, stop)));
  const auto chosen = place_in_turn(*problem, matcher, 2, {}, [](std::size_t) {});
  ASSERT_TRUE(chosen.ok());
  const PatchPlacements placed = placements_of(*problem, matcher, *chosen);
  const auto quiet = [](double) {};
  EXPECT_TRUE(cancelled(plan_globally(
      *problem, matcher, *chosen, options, 2, [](double, const std::string&) {}, stop)));
  EXPECT_TRUE(cancelled(turn_finely(*problem, matcher, placed, 2, quiet, stop)));
  EXPECT_TRUE(cancelled(refine_boundaries(*problem, matcher, placed, options, 2, quiet, stop)));
  EXPECT_TRUE(cancelled(find_alternatives(stock, *problem, matcher, placed, placed.size(), 3, 2, stop)));
  EXPECT_TRUE(cancelled(take_anew(matcher, *problem, placed, 2, stop)));
  EXPECT_TRUE(cancelled(matcher.give_back(2, stop)));
  options.kept = {{mark_of("A", problem->artworks[0].patches[0]), 1, {}, false}};
  EXPECT_TRUE(cancelled(keep_pieces(artworks, stock, options, *problem, stop)));
  EXPECT_TRUE(cancelled(make_plan(artworks, stock, options, {}, stop)));
}

// Asked for, a stage gives what it has, and says whether that is all.
TEST(BestSoFar, SaysWhetherAllWasDone) {
  std::stop_source source;
  source.request_stop();
  const std::stop_token stop = source.get_token();
  PlanOptions options;
  options.patch = 4_mm, options.dpi = 50.8, options.rotations = 3;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 16_mm, 3)};
  const std::vector<StockPanel> stock{test::wood_panel("P", 100, 90, 50.8, 1)};
  auto problem = make_problem(artworks, stock, options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  ShortlistMatcher matcher(problem->panels, turns(3), problem->classes, largest_response(options));
  ASSERT_TRUE(matcher.build_index(2, {}).ok());
  const auto chosen = place_in_turn(*problem, matcher, 2, {}, [](std::size_t) {});
  ASSERT_TRUE(chosen.ok());
  const PatchPlacements placed = placements_of(*problem, matcher, *chosen);
  const auto quiet = [](double) {};
  const auto cost = [](const PatchPlacements& patches) {
    double sum = 0;
    for (const auto& patch : patches) sum += patch ? patch->cost : 0;
    return sum;
  };

  const auto global = plan_globally(
      *problem, matcher, *chosen, options, 2, [](double, const std::string&) {}, stop, nullptr, nullptr,
      OnStop::kBestSoFar);
  ASSERT_TRUE(global.ok());
  EXPECT_TRUE(global->report.stopped);
  EXPECT_EQ(cost(global->patches), cost(placed));
  const auto fine = turn_finely(*problem, matcher, placed, 2, quiet, stop, nullptr, OnStop::kBestSoFar);
  ASSERT_TRUE(fine.ok());
  EXPECT_TRUE(fine->stopped);
  EXPECT_EQ(fine->report.moved, 0U);
  EXPECT_EQ(cost(fine->patches), cost(placed));
  // Where there is nothing to turn, all of it was turned before the request.
  const PatchPlacements nowhere(problem->queue.size());
  for (const OnStop on_stop : {OnStop::kCancel, OnStop::kBestSoFar}) {
    const auto nothing = turn_finely(*problem, matcher, nowhere, 2, quiet, stop, nullptr, on_stop);
    ASSERT_TRUE(nothing.ok());
    EXPECT_FALSE(nothing->stopped);
  }
  const auto refined = refine_boundaries(*problem, matcher, placed, options, 2, quiet, stop, OnStop::kBestSoFar);
  ASSERT_TRUE(refined.ok());
  EXPECT_TRUE(refined->stopped);
  EXPECT_EQ(refined->report.cost, refined->report.cost_before);
  const auto shortage = missing_wood(*problem, nowhere);
  ASSERT_TRUE(shortage.has_value());
  EXPECT_EQ(shortage->unfilled, nowhere.size());
  EXPECT_FALSE(shortage->left.has_value());
}

TEST(RunParallel, AnswersTheFirstTaskThatFailsAndBeginsNoOther) {
  std::atomic<int> begun{0};
  const Status answer = run_parallel(100, 1, {}, [&](std::size_t i) -> Status {
    ++begun;
    if (i == 3) return Error{ErrorCode::kStorage, "the fourth cannot be done"};
    return Ok();
  });
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().message, "the fourth cannot be done");
  EXPECT_EQ(begun, 4);
}

// A plan that was stopped anywhere is no plan, and nothing much is done after the request.
void expect_whole_plans_to_stop(PlanOptions options, std::size_t moments) {
  options.patch = 8_mm, options.dpi = 150, options.threads = 1;
  options.priority = Priority::kCentre;  // saliency is OpenCV's: it cannot be interrupted
  const std::vector<Artwork> artworks{test::blob_artwork("A", 60, 60, 24_mm, 5)};
  const std::vector<StockPanel> stock{test::wood_panel("P", 800, 640, 150, 6), test::wood_panel("Q", 500, 400, 100, 7)};
  const auto unbroken = make_plan(artworks, stock, options);
  ASSERT_TRUE(unbroken.ok()) << unbroken.error().message;
  ASSERT_EQ(unfilled(*unbroken), 0U);
  const std::string all = plan_to_json(*unbroken);
  const Work work = [&](const std::stop_token& stop) {
    const auto plan = make_plan(artworks, stock, options, {}, stop);
    // Too late to be heeded: then it is whole.
    if (plan.ok()) {
      EXPECT_EQ(plan_to_json(*plan), all);
      EXPECT_EQ(plan->warnings, unbroken->warnings);
    } else {
      EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
    }
  };
  const double whole = whole_of(work);
  std::size_t stopped = 0;
  for (std::size_t i = 0; i < moments; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(moments);
    const double rest = rest_of(work, share, whole);
    stopped += rest > 0 ? 1 : 0;
    EXPECT_LT(rest, 0.05) << "stopped after " << share;
  }
  EXPECT_GT(stopped, moments / 2);
}

TEST(StoppedPlan, IsNoPlanAndEndsSoon) { expect_whole_plans_to_stop({}, 12); }

TEST(StoppedPlan, EndsSoonWhenItIsExactToo) {
  PlanOptions options;
  options.exact = true, options.rotations = 4;
  expect_whole_plans_to_stop(options, 8);
}

// What only betters a plan that is there.
TEST(StoppedPlan, IsNoneHoweverFarItIs) {
  PlanOptions options;
  options.optimize = Optimize::kGlobal, options.optimize_iterations = 20000, options.fine_rotation = true;
  options.alternatives = 2;
  expect_whole_plans_to_stop(options, 8);
  options = {};
  options.refine = Refine::kDp;
  expect_whole_plans_to_stop(options, 8);
}

TEST(StoppedPlan, KeepsOnlyWholeIndexes) {
  namespace fs = std::filesystem;
  const testing::TempDirectory directory;
  PlanOptions options;
  options.patch = 8_mm, options.dpi = 150, options.threads = 1, options.rotations = 6;
  options.priority = Priority::kCentre;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 60, 60, 24_mm, 5)};
  const std::vector<StockPanel> stock{test::wood_panel("P", 800, 640, 150, 6)};
  const auto planned = [&](const std::stop_token& stop) { return make_plan(artworks, stock, options, {}, stop); };
  const auto expected = planned({});
  ASSERT_TRUE(expected.ok()) << expected.error().message;
  const double whole = whole_of([&](const auto& stop) { (void)planned(stop).ok(); });
  for (const double share : {0.2, 0.4, 0.6, 0.3, 0.5}) {
    options.index_cache = (directory / "index").string();
    const StopInTheMidst stop(whole * share);
    (void)planned(stop.token()).ok();
    for (const auto& file : fs::directory_iterator(directory / "index"))
      EXPECT_EQ(file.path().extension(), ".index") << "half an entry is left: " << file.path();
  }
  const auto plan = planned({});
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_EQ(cost_total(*plan), cost_total(*expected));
}

}  // namespace
}  // namespace veneer::planner
