#include "planner/poses/near_search.h"

#include <gtest/gtest.h>

#include "planner/problem/problem.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

// One patch of so many pixels a side, and wood for it.
struct Scene {
  explicit Scene(int pixels) {
    PlanOptions options;
    options.dpi = 50.8, options.patch = Millimetres(pixels / 2.0), options.priority = Priority::kCentre;
    const StockPanel panel = test::wood_panel("P", 3 * pixels, 3 * pixels, 50.8, 4);
    const Artwork artwork = test::blob_artwork("A", 40, 40, options.patch, 3);
    auto made = make_problem({&artwork, 1}, {&panel, 1}, options);
    if (!made.ok()) throw std::runtime_error(made.error().message);
    problem.emplace(std::move(*made));
  }
  const MatchPatch& patch() const { return problem->queue.front().match; }

  std::optional<Problem> problem;
};

class NearSearchOfPixels : public ::testing::TestWithParam<int> {};

TEST_P(NearSearchOfPixels, FindsAPlaceAsGoodAsTheBestOfAllNearby) {
  const int pixels = GetParam(), reach = 3;
  const Scene scene(pixels);
  const Footprint footprint(scene.patch().outline, Millimetres(0));
  const NearSearch near(scene.patch(), footprint, scene.problem->panels);
  for (const double angle : {0.0, 0.4, 2.5}) {
    const Pose from = pose_at(0, 0.75 * pixels, 0.75 * pixels, angle);
    const auto allowed = [&](const Pose& pose) { return pose.x != from.x || pose.y != from.y; };
    double least = std::numeric_limits<double>::infinity();
    for (int right = -reach; right <= reach; ++right)
      for (int up = -reach; up <= reach; ++up) {
        const double x = right / 2.0, y = up / 2.0;
        const Pose pose = pose_at(0, from.x + from.cos * x - from.sin * y, from.y + from.sin * x + from.cos * y, angle);
        if (right != 0 || up != 0) least = std::min(least, near.cost(pose));
      }
    const auto best = near.best(from, reach, allowed);
    ASSERT_TRUE(best.has_value());
    EXPECT_TRUE(allowed(best->pose));
    EXPECT_NEAR(best->cost, near.cost(best->pose), 1e-3 * best->cost);
    EXPECT_LT(best->cost, 1.005 * least);
  }
  EXPECT_FALSE(near.best(pose_at(0, pixels, pixels, 0), reach, [](const Pose&) { return false; }).has_value());
}

INSTANTIATE_TEST_SUITE_P(Pixels, NearSearchOfPixels, ::testing::Values(4, 7, 48, 100));

TEST(NearSearch, CostsAreThoseOfTheMatcher) {
  const Scene scene(37);
  const Footprint footprint(scene.patch().outline, Millimetres(0));
  const NearSearch near(scene.patch(), footprint, scene.problem->panels);
  // In the midst of the wood, and beyond its corner.
  for (const Pose& pose : {pose_at(0, 28, 28, 0.7), pose_at(0, 3, 50, 0.3)}) {
    const double exact = placement_cost(*scene.patch().features, scene.patch().grid, scene.patch().pixels,
                                        scene.problem->panels.front().features, footprint.panel_from_artwork(pose));
    EXPECT_NEAR(near.cost(pose), exact, 1e-4 * exact);
  }
}

}  // namespace
}  // namespace veneer::planner
