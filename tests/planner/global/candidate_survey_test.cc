// How many places the survey keeps for a patch before it thins and measures them, and that it looks where each fits.
#include "planner/global/candidate_survey.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "planner/matching/shortlist_matcher.h"
#include "planner/pictures/features.h"
#include "planner/problem/problem.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

constexpr int kPatch = 24;   // pixels, so that the survey's regions are 8 wide
constexpr int kPanel = 128;  // pixels

// A dark spot that fades evenly: the farther a window lies from it, the more it costs.
cv::Mat spot(cv::Size size, cv::Point2d middle) {
  cv::Mat out(size, CV_8UC3);
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c) {
      const double far = std::hypot(c + 0.5 - middle.x, r + 0.5 - middle.y);
      out.at<cv::Vec3b>(r, c) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(200 - 160 * std::exp(-far * far / 50)));
    }
  return out;
}

// One patch, a spot, and one panel that has the same spot where four regions meet. So the four cheapest places are the
// nearest ones of these regions, which are one place to a person, and all others lie farther away.
class CandidateSurvey : public ::testing::Test {
 protected:
  CandidateSurvey() {
    artwork_ = test::blob_artwork("A", kPatch, kPatch, 12_mm, 1);
    artwork_.picture = spot({kPatch, kPatch}, {kPatch / 2.0, kPatch / 2.0});
    options_.patch = 12_mm, options_.dpi = 50.8, options_.rotations = 1, options_.threads = 1;
    options_.w_edge = 0, options_.w_hist = 0;
    stock_ = {panel("P", 64, 56)};
  }
  static StockPanel panel(const std::string& id, double column, double row) {
    StockPanel out = test::wood_panel(id, kPanel, kPanel, 50.8, 1);
    out.picture.pixels = spot({kPanel, kPanel}, {column, row});
    out.free.pixels.setTo(255);
    out.material = id;
    return out;
  }

  Problem problem() {
    auto made = make_problem({&artwork_, 1}, stock_, options_);
    if (!made.ok()) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  Survey surveyed(const Problem& problem, std::size_t candidates) {
    ShortlistMatcher matcher(problem.panels, turns(1), problem.classes, largest_response(options_));
    EXPECT_TRUE(matcher.build_index(1, {}).ok());
    std::vector<Footprint> footprints;
    for (const auto& task : problem.queue)
      footprints.emplace_back(task.match.outline, options_.kerf + FreeWood::kSlack);
    auto survey = survey_candidates(problem, matcher, footprints, {}, {candidates, 1}, {});
    EXPECT_TRUE(survey.ok());
    return std::move(*survey);
  }

  // How many candidates are found where `candidates` are asked for.
  std::size_t found(std::size_t candidates) {
    const Problem one = problem();
    EXPECT_EQ(one.queue.size(), 1U);
    const Survey survey = surveyed(one, candidates);
    EXPECT_LT(survey.candidates[0][0].cost, 0.1) << "the spot itself is among them";
    return survey.candidates[0].size();
  }

  Artwork artwork_;
  std::vector<StockPanel> stock_;
  PlanOptions options_;
};

// Twice as many regions as candidates are asked for, since about half of them are thinned. Here four fall together, so
// what is found tells how many were looked at.
TEST_F(CandidateSurvey, KeepsTwiceAsManyRegionsAsCandidatesAreWanted) {
  EXPECT_EQ(found(1), 1U);
  EXPECT_EQ(found(2), 1U) << "four regions, all of one place";
  EXPECT_EQ(found(3), 3U) << "and two further ones";
}

// Each wood has its part of them, rounded up: of five, three of each of two woods, so six regions of each.
TEST_F(CandidateSurvey, SharesThemAmongTheWoodsThatAreLimited) {
  stock_.push_back(panel("Q", 64, 56));
  options_.material_limits = {{"P", 1}};
  EXPECT_EQ(found(2), 2U) << "one of each wood";
  options_.material_limits = {{"P", 1}, {"Q", 1}};
  EXPECT_EQ(found(2), 2U) << "other wood is none, and has no part of them";
  EXPECT_EQ(found(4), 2U) << "four regions of each wood, all of one place";
  EXPECT_EQ(found(5), 4U) << "six regions of each wood, and a place further off, too";
}

// Two patches of one class, one half as wide as the other, and two pieces of wood, one too small for the larger patch.
TEST_F(CandidateSurvey, FindsForEachPatchOfAClassTheWoodThatItFitsOn) {
  artwork_ = test::blob_artwork("A", 2 * kPatch, kPatch, 12_mm, 1);
  cv::Mat& free = stock_[0].free.pixels;
  free.setTo(0);
  free(cv::Rect(10, 50, 20, 20)).setTo(255);  // 10 mm
  free(cv::Rect(70, 40, 40, 40)).setTo(255);
  for (const std::size_t small : {1, 0}) {
    Problem two = problem();
    ASSERT_EQ(two.queue.size(), 2U);
    MatchPatch& patch = two.queue[small].match;
    ASSERT_EQ(patch.window_class, two.queue[1 - small].match.window_class);
    const Point<ArtworkFrame> corner = bounds(patch.outline).min;
    patch.outline = {
        corner, {corner.x + 6_mm, corner.y}, {corner.x + 6_mm, corner.y + 6_mm}, {corner.x, corner.y + 6_mm}};
    patch.pixels = patch_pixels(patch.outline, patch.grid, patch.features->cols, patch.features->rows);
    const Survey survey = surveyed(two, 40);
    const auto on_the_small_wood = [&](std::size_t i) {
      return std::count_if(survey.candidates[i].begin(), survey.candidates[i].end(),
                           [](const Candidate& it) { return it.pose.x < 20; });
    };
    EXPECT_GT(on_the_small_wood(small), 0) << small;
    EXPECT_EQ(on_the_small_wood(1 - small), 0) << small;
    EXPECT_FALSE(survey.candidates[1 - small].empty()) << small;
  }
}

// Two patches of one class, each the other's mirror image, and wood on which only one of them fits.
TEST_F(CandidateSurvey, LooksForMirroredPatchesWhereEachFits) {
  artwork_ = test::blob_artwork("A", 2 * kPatch, kPatch, 12_mm, 1);
  cv::Mat& free = stock_[0].free.pixels;
  free.setTo(0);
  // 20 mm long, too short for 12 mm of the other hand.
  const auto triangle = [&](int corner, int end) {
    cv::fillConvexPoly(free, std::vector<cv::Point>{{corner, 80}, {corner, 40}, {end, 80}}, cv::Scalar(255));
  };
  triangle(10, 50), triangle(110, 70);
  for (const std::size_t left : {0, 1}) {
    Problem two = problem();
    ASSERT_EQ(two.queue.size(), 2U);
    for (const std::size_t i : {0, 1}) {
      MatchPatch& patch = two.queue[i].match;
      const Box<ArtworkFrame> box = bounds(patch.outline);
      const Point<ArtworkFrame> right_down{box.max.x, box.min.y}, left_up{box.min.x, box.max.y};
      patch.outline = i == left ? Ring<ArtworkFrame>{box.min, right_down, left_up}
                                : Ring<ArtworkFrame>{box.min, right_down, box.max};
      patch.pixels = patch_pixels(patch.outline, patch.grid, patch.features->cols, patch.features->rows);
    }
    ASSERT_EQ(two.queue[0].match.window_class, two.queue[1].match.window_class);
    const Survey survey = surveyed(two, 40);
    for (const std::size_t i : {0, 1}) {
      EXPECT_FALSE(survey.candidates[i].empty()) << left << ' ' << i;
      for (const Candidate& it : survey.candidates[i]) EXPECT_EQ(it.pose.x < 30, i == left) << left << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace veneer::planner
