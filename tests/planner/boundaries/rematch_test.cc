// Wood chosen again for pieces of other shapes than those that were surveyed.
#include "planner/boundaries/rematch.h"

#include <gtest/gtest.h>
#include <cmath>

#include <memory>
#include <stdexcept>

#include "planner/global/global_plan.h"
#include "planner/greedy/greedy.h"
#include "planner/matching/certified_matcher.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_picture;

constexpr Millimetres kGrowth{0.8};  // of the shapes, beyond the patches that were surveyed

PlanOptions plain_options() {
  PlanOptions options = test::small_options_without_saliency();
  options.w_hist = 0, options.rotations = 4;
  options.position_margin = 1_mm;
  return options;
}

// 64 x 48 mm with a hole every 16 mm, so that all wood lies near one. The mask has a resolution of its own.
StockPanel holed_panel(const std::string& id, const cv::Mat& picture, double mask_dpi) {
  StockPanel panel;
  panel.id = {id};
  panel.picture.pixels = picture;
  panel.picture.resolution = ScanResolution::from_dpi(50.8);
  panel.free.resolution = ScanResolution::from_dpi(mask_dpi);
  const auto px = [&](double mm) {
    return static_cast<int>(std::lround(panel.free.resolution.to_px(Millimetres(mm)).count()));
  };
  panel.free.pixels = cv::Mat(px(48), px(64), CV_8UC1, cv::Scalar(255));
  for (int x = 0; x < 64; x += 16)
    for (int y = 0; y < 48; y += 16)
      panel.free.pixels(cv::Rect(cv::Point(px(x), px(y)), cv::Point(px(x + 1), px(y + 1)))).setTo(0);
  return panel;
}

struct ChosenAgain {
  PatchPlacements before, after;
  std::vector<Ring<ArtworkFrame>> outlines;
};

// Placed in turn on the first panel alone, then chosen again on both for shapes that are larger.
ChosenAgain chosen_again(const std::vector<StockPanel>& stock, const PlanOptions& options) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 28_mm, 1)};
  const auto matcher_of = [&](Problem& problem) {
    auto matcher = std::make_unique<CertifiedMatcher>(std::move(problem.panels), turns(options.rotations),
                                                      problem.classes, problem.entries_per_unit);
    if (!matcher->build_index(1, {}).ok()) throw std::runtime_error("no index");
    return matcher;
  };
  ChosenAgain out;
  Result<Problem> alone = make_problem(artworks, std::span(stock).first(1), options);
  const auto first = matcher_of(*alone);
  out.before = placements_of(*alone, *first, *place_in_turn(*alone, *first, 1, {}, [](std::size_t) {}));
  Result<Problem> problem = make_problem(artworks, stock, options);
  const auto both = matcher_of(*problem);
  for (const Problem::Task& task : problem->queue)
    out.outlines.push_back(offset(Region<ArtworkFrame>(task.match.outline), kGrowth).rings().front());
  const Rematch rematch = *Rematch::survey(*problem, *both, {.candidates = 100, .iterations = 200}, {});
  out.after = *rematch.choose(out.outlines, out.before, 0, {});
  return out;
}

// Dots a millimetre of the first panel's mask and of the second's, whose wood is the better one.
class RematchOnMasks : public ::testing::TestWithParam<std::pair<double, double>> {};

TEST_P(RematchOnMasks, TakesTheBetterWoodAndKeepsItsBorderOnEveryPanel) {
  const PlanOptions options = plain_options();
  const auto [first, second] = GetParam();
  const std::vector<StockPanel> stock{holed_panel("P", cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(0)), first * 25.4),
                                      holed_panel("Q", wood_picture(128, 96, 3), second * 25.4)};
  const ChosenAgain chosen = chosen_again(stock, options);
  std::size_t moved = 0;
  const FreeWood wood(stock[1].free, options.kerf, options.position_margin);
  for (std::size_t i = 0; i < chosen.after.size(); ++i) {
    if (!chosen.after[i] || chosen.after[i]->panel == 0) continue;
    ++moved;
    EXPECT_TRUE(wood.on_free_wood(chosen.after[i]->panel_from_artwork * chosen.outlines[i])) << i;
  }
  EXPECT_GE(moved, 4U);
}

INSTANTIATE_TEST_SUITE_P(DotsAMillimetre, RematchOnMasks,
                         ::testing::Values(std::pair(2.0, 2.0), std::pair(10.0, 2.0), std::pair(2.0, 10.0)));

}  // namespace
}  // namespace veneer::planner
