#include "planner/problem/priority.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <set>

#include "planner/files/plan_files.h"
#include "planner/problem/problem.h"
#include "planner/problem/shared_work.h"
#include "tests/support/patch_shapes.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::wood_panel;

TEST(Order, SalientPatchesChooseFirstAtAnyWorkingResolution) {
  Artwork artwork = blob_artwork("A", 200, 200, 80_mm, 71);
  artwork.picture.setTo(cv::Scalar::all(128));
  cv::circle(artwork.picture, {150, 50}, 14, cv::Scalar::all(255), cv::FILLED);
  const auto patches = grid_layout(artwork.width, artwork.height, 20_mm);
  SaliencyMaps maps;
  const auto order = by_urgency(urgencies(artwork, patches, Priority::kSaliency, maps));
  const auto& first = patches[order.front()];
  EXPECT_TRUE(bounds(first.outline).max.x > 40_mm && bounds(first.outline).max.y > 40_mm);
}

TEST(Order, CentralPatchesChooseFirstByDistance) {
  const Artwork artwork = blob_artwork("A", 50, 50, 50_mm, 72);
  const auto patches = grid_layout(artwork.width, artwork.height, 10_mm);
  SaliencyMaps maps;
  const auto order = by_urgency(urgencies(artwork, patches, Priority::kCentre, maps));
  EXPECT_EQ(patches[order.front()].row, 2);
  EXPECT_EQ(patches[order.front()].column, 2);
  EXPECT_EQ(patches[order.back()].row % 4, 0);
}

TEST(Order, ThePlansOfAPictureShareItsMap) {
  const std::vector<StockPanel> stock{wood_panel("P", 90, 90, 50.8, 3)};
  PlanOptions options;
  options.patch = 5_mm, options.dpi = 50.8, options.rotations = 1;
  std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 20_mm, 5)};
  SharedWork shared;
  const auto one = make_plan(artworks, stock, options, {}, {}, nullptr, &shared);
  EXPECT_EQ(shared.saliency.size(), 1U);
  artworks.push_back(artworks.front());  // shares its pixels
  artworks.back().letter = "B";
  const auto two = make_plan(artworks, stock, options, {}, {}, nullptr, &shared);
  EXPECT_EQ(shared.saliency.size(), 1U);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(plan_to_json(*two), plan_to_json(*make_plan(artworks, stock, options)));
  artworks.push_back(blob_artwork("C", 40, 40, 20_mm, 6));
  ASSERT_TRUE(make_problem(artworks, stock, options, {}, &shared.saliency).ok());
  EXPECT_EQ(shared.saliency.size(), 2U);
}

// Artwork and patch of every place in the queue.
std::vector<std::pair<std::size_t, std::size_t>> queue_of(const std::vector<Artwork>& artworks,
                                                          const PlanOptions& options) {
  const std::vector<StockPanel> stock{wood_panel("P", 90, 90, 50.8, 3)};
  const auto problem = make_problem(artworks, stock, options);
  if (!problem.ok()) throw std::runtime_error(problem.error().message);
  std::vector<std::pair<std::size_t, std::size_t>> out;
  for (const auto& task : problem->queue) out.emplace_back(task.artwork, task.patch);
  return out;
}

PlanOptions options_at(double dpi) {
  PlanOptions options;
  options.patch = 5_mm, options.dpi = dpi, options.rotations = 1;
  return options;
}

TEST(Order, DoesNotDependOnTheWorkingResolution) {
  const std::vector<Artwork> artworks{blob_artwork("A", 150, 110, 40_mm, 5)};
  for (const Priority priority : {Priority::kSaliency, Priority::kCentre}) {
    PlanOptions options = options_at(40);
    options.priority = priority;
    const auto coarse = queue_of(artworks, options);
    ASSERT_EQ(coarse.size(), 8U * 11U);
    for (const double dpi : {75.0, 150.0}) {
      options.dpi = dpi;
      EXPECT_EQ(queue_of(artworks, options), coarse) << dpi;
    }
  }
}

TEST(Order, ImportanceMovesPatchesForward) {
  Artwork artwork = blob_artwork("A", 150, 150, 40_mm, 6);
  artwork.importance = cv::Mat(30, 30, CV_8UC1, cv::Scalar(10));
  artwork.importance(cv::Rect(20, 20, 10, 10)).setTo(255);  // the lower right third
  const auto patches = grid_layout(artwork.width, artwork.height, 5_mm);
  const auto important = importances(artwork, patches);
  EXPECT_NEAR(important.front(), 10 / 255.0, 1e-6);
  EXPECT_NEAR(important.back(), 1, 1e-6);
  SaliencyMaps maps;
  const auto weighed = urgencies(artwork, patches, Priority::kSaliency, maps);
  artwork.importance = cv::Mat();
  EXPECT_EQ(importances(artwork, patches), std::vector<double>(patches.size(), 1.0));
  const auto plain = urgencies(artwork, patches, Priority::kSaliency, maps);
  // What matters keeps its urgency, all else has a 25th of its own.
  std::vector<std::size_t> inside;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const int third = std::min(patches[i].row, patches[i].column);
    if (third == 5) continue;  // on the third's rim
    if (third > 5) inside.push_back(i);
    EXPECT_NEAR(weighed[i], plain[i] * important[i], 1e-6 * plain[i]) << i;
  }
  const auto moved = by_urgency(weighed), before = by_urgency(plain);
  const auto place = [](const std::vector<std::size_t>& order, std::size_t patch) {
    return std::find(order.begin(), order.end(), patch) - order.begin();
  };
  std::ptrdiff_t forward = 0;
  for (const std::size_t i : inside) {
    EXPECT_LE(place(moved, i), place(before, i));
    forward += place(before, i) - place(moved, i);
  }
  EXPECT_GT(forward, 0);
}

// A picture may be planned several times, with what matters marked in it anew.
TEST(Order, ImportanceIsCountedOnceInEachPlanOfAPicture) {
  Artwork artwork = blob_artwork("A", 60, 60, 20_mm, 3);
  const auto patches = grid_layout(artwork.width, artwork.height, 5_mm);
  artwork.importance = cv::Mat(60, 60, CV_8UC1, cv::Scalar(51));
  SaliencyMaps maps;
  const auto once = urgencies(artwork, patches, Priority::kSaliency, maps);
  EXPECT_EQ(urgencies(artwork, patches, Priority::kSaliency, maps), once);
  EXPECT_EQ(cv::norm(maps.of(artwork.picture), saliency_of(artwork.picture), cv::NORM_INF), 0);
}

// What lies in the notch of an L or beyond a slope is not the patch's.
TEST(Order, ImportanceIsThatOfThePatchAndNotOfItsBoundingBox) {
  Artwork artwork = blob_artwork("A", 100, 100, 100_mm, 73);
  artwork.importance = cv::Mat(100, 100, CV_8UC1, cv::Scalar(0));
  artwork.importance(cv::Rect(40, 0, 60, 65)).setTo(255);  // the L's notch, at the upper right
  std::vector<Patch> patches(4);
  const auto laid = [](const test::Shape& shape) {
    Ring<ArtworkFrame> out;
    for (const auto& [x, y] : shape) out.push_back(point<ArtworkFrame>(100 * x, 100 * y));
    return out;
  };
  patches[0].outline = laid({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  patches[1].outline = laid(test::ell(0));
  patches[2].outline = laid({{0.4, 0.35}, {1, 0.35}, {1, 1}});
  patches[3].outline = laid({{0, 0}, {1, 1}, {0, 1}});
  const auto important = importances(artwork, patches);
  EXPECT_NEAR(important[0], 0.6 * 0.65, 1e-6);
  EXPECT_NEAR(important[1], 0, 1e-6);
  EXPECT_NEAR(important[2], 1, 1e-6);
  // Half of the square's: x from 0.4 on and y from x up.
  EXPECT_NEAR(important[3], 2 * 0.6 * 0.6 / 2, 1e-3);
}

TEST(Order, ArtworksChooseOneAfterTheOtherOrTogether) {
  const std::vector<Artwork> artworks{blob_artwork("A", 60, 60, 20_mm, 7), blob_artwork("B", 60, 60, 20_mm, 7)};
  PlanOptions options = options_at(75);
  const auto sequential = queue_of(artworks, options);
  ASSERT_EQ(sequential.size(), 32U);
  for (std::size_t i = 0; i < 32; ++i) EXPECT_EQ(sequential[i].first, i / 16) << i;
  options.interleave = true;
  const auto together = queue_of(artworks, options);
  // The same picture twice: its patches stand side by side, the first picture's before the second's.
  for (std::size_t i = 0; i < 32; ++i) {
    EXPECT_EQ(together[i].first, i % 2) << i;
    EXPECT_EQ(together[i].second, sequential[i / 2].second) << i;
  }
}

TEST(Order, ReservesWoodForTheMostSalientPatchesOfEveryArtwork) {
  const std::vector<Artwork> artworks{blob_artwork("A", 60, 60, 20_mm, 7), blob_artwork("B", 60, 60, 20_mm, 8)};
  PlanOptions options = options_at(75);
  const auto sequential = queue_of(artworks, options);
  options.reserve = 0.25;
  const auto reserved = queue_of(artworks, options);
  ASSERT_EQ(reserved.size(), 32U);
  // Four of each artwork's sixteen patches come first: those that came first in their own artwork.
  using Patches = std::set<std::pair<std::size_t, std::size_t>>;
  Patches first(reserved.begin(), reserved.begin() + 8), wanted(sequential.begin(), sequential.begin() + 4);
  wanted.insert(sequential.begin() + 16, sequential.begin() + 20);
  EXPECT_EQ(first, wanted);
  // The others keep their order.
  EXPECT_TRUE(std::equal(reserved.begin() + 8, reserved.begin() + 20, sequential.begin() + 4));
  EXPECT_TRUE(std::equal(reserved.begin() + 20, reserved.end(), sequential.begin() + 20));
  options.reserve = 1;
  const auto all = queue_of(artworks, options);
  options.reserve = 0, options.interleave = true;
  EXPECT_EQ(all, queue_of(artworks, options));
}

TEST(Order, CopiesOfAPictureShareItsMap) {
  const Artwork artwork = test::blob_artwork("A", 60, 60, 20_mm, 3), other = test::blob_artwork("B", 60, 60, 20_mm, 4);
  const Artwork copy = artwork;
  SaliencyMaps maps;
  const cv::Mat first = maps.of(artwork.picture);
  EXPECT_EQ(maps.of(copy.picture).data, first.data);
  EXPECT_NE(maps.of(other.picture).data, first.data);
  EXPECT_EQ(cv::norm(first, saliency_of(artwork.picture), cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(maps.of(other.picture), saliency_of(other.picture), cv::NORM_INF), 0);
}

}  // namespace
}  // namespace veneer::planner
