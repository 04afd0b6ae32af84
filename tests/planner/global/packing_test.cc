#include "planner/global/packing.h"

#include <gtest/gtest.h>

#include "planner/matching/certified_matcher.h"
#include "planner/problem/problem.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

constexpr double kDpi = 50.8;  // 2 pixels a mm

// A matcher on wood that is free where `free` is not 0, at 15 rotations.
std::unique_ptr<Matcher> matcher_on(const cv::Mat& free, const PlanOptions& options) {
  StockPanel panel = test::wood_panel("P", free.cols, free.rows, kDpi, 1);
  panel.free.pixels = free;
  const Artwork artwork = test::blob_artwork("A", 20, 20, 14_mm, 1);
  auto problem = make_problem({&artwork, 1}, {&panel, 1}, options);
  if (!problem.ok()) throw std::runtime_error(problem.error().message);
  return std::make_unique<CertifiedMatcher>(std::move(problem->panels), turns(options.rotations), problem->classes,
                                            problem->entries_per_unit);
}

PlanOptions options_with(Millimetres kerf) {
  PlanOptions options;
  options.dpi = kDpi, options.patch = 7_mm, options.kerf = kerf, options.threads = 2;
  options.priority = Priority::kCentre;
  return options;
}

void expect_packed(const Matcher& matcher, const std::vector<Pose>& poses, Millimetres width, Millimetres height) {
  const Millimetres x = width / 2, y = height / 2;
  const Ring<ArtworkFrame> outline{{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  FreeWood wood = matcher.panels().front().wood.untouched();
  const Footprint footprint(outline, wood.kerf());
  for (const Pose& pose : poses) {
    const auto laid = footprint.panel_from_artwork(pose) * outline;
    EXPECT_TRUE(wood.admits(laid));
    wood.allocate(laid);
  }
}

TEST(Packing, FillsARectangleWithRowsSideBySide) {
  const auto matcher = matcher_on(cv::Mat(100, 160, CV_8UC1, cv::Scalar(255)), options_with(0.15_mm));
  // 80 mm hold ten of 7.3 mm, 50 mm six.
  const auto poses = *pack_rectangles(*matcher, 7_mm, 7_mm, 60, 1, {});
  EXPECT_GE(poses.size(), 60U);
  expect_packed(*matcher, poses, 7_mm, 7_mm);
}

TEST(Packing, FillsColumnsWhereRowsDoNotMeet) {
  // Three boards side by side, the middle one half a rectangle lower: five on each, but rows across find only four
  // there.
  cv::Mat free(84, 48, CV_8UC1, cv::Scalar(0));
  for (const int left : {0, 16, 32}) free(cv::Rect(left, left == 16 ? 8 : 0, 16, 76)).setTo(255);
  PlanOptions options = options_with(0.15_mm);
  options.rotations = 1;
  const auto matcher = matcher_on(free, options);
  const auto poses = *pack_rectangles(*matcher, 7_mm, 7_mm, 15, 1, {});
  EXPECT_EQ(poses.size(), 15U);
  expect_packed(*matcher, poses, 7_mm, 7_mm);
}

TEST(Packing, KeepsThePositionMarginFromWoodThatIsNotFree) {
  PlanOptions options = options_with(0.15_mm);
  options.position_margin = 0.6_mm;
  cv::Mat free(100, 160, CV_8UC1, cv::Scalar(255));
  cv::circle(free, {70, 50}, 8, cv::Scalar(0), cv::FILLED);
  const auto matcher = matcher_on(free, options);
  const auto poses = *pack_rectangles(*matcher, 7_mm, 9_mm, 100, 1, {});
  EXPECT_GT(poses.size(), 25U);
  expect_packed(*matcher, poses, 7_mm, 9_mm);
}

class PackingOfSeed : public ::testing::TestWithParam<int> {};

// Wood that is hardly more than a known packing of turned blocks.
TEST_P(PackingOfSeed, FindsRoomForAllThatAreKnownToFit) {
  cv::RNG random(static_cast<std::uint64_t>(GetParam()));
  const PlanOptions options = options_with(0.15_mm);
  cv::Mat free(300, 400, CV_8UC1, cv::Scalar(0));
  const double side = 2 * (7 + 2 * 0.15);  // pixels
  std::size_t known = 0;
  for (int tried = 0; tried < 3000; ++tried) {
    const int columns = random.uniform(1, 5), rows = random.uniform(1, 5);
    const double angle = 2 * CV_PI * random.uniform(0, options.rotations) / options.rotations;
    const cv::Point2f centre{random.uniform(0.F, 400.F), random.uniform(0.F, 300.F)};
    const cv::RotatedRect block(centre,
                                cv::Size2f(static_cast<float>(columns * side) + 3, static_cast<float>(rows * side) + 3),
                                static_cast<float>(-angle * 180 / CV_PI));
    cv::Point2f corners[4];
    block.points(corners);
    std::vector<cv::Point> polygon(corners, corners + 4);
    if (std::any_of(polygon.begin(), polygon.end(),
                    [&](const cv::Point& p) { return p.x < 0 || p.y < 0 || p.x >= 400 || p.y >= 300; }))
      continue;
    cv::Mat filled(free.size(), CV_8UC1, cv::Scalar(0));
    cv::fillConvexPoly(filled, polygon, cv::Scalar(255));
    if (cv::countNonZero(filled & free) > 0) continue;
    free |= filled;
    known += static_cast<std::size_t>(columns * rows);
  }
  const auto matcher = matcher_on(free, options);
  const auto poses = *pack_rectangles(*matcher, 7_mm, 7_mm, known, 1, {});
  EXPECT_GE(static_cast<double>(poses.size()), 0.98 * static_cast<double>(known));
  expect_packed(*matcher, poses, 7_mm, 7_mm);
  EXPECT_EQ(*pack_rectangles(*matcher, 7_mm, 7_mm, known, 3, {}), poses);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PackingOfSeed, ::testing::Range(1, 5));

TEST(Packing, FindsNothingWhereNothingFits) {
  cv::Mat free(100, 160, CV_8UC1, cv::Scalar(0));
  free(cv::Rect(10, 10, 12, 80)).setTo(255);
  const auto matcher = matcher_on(free, options_with(0.15_mm));
  EXPECT_TRUE(pack_rectangles(*matcher, 7_mm, 7_mm, 10, 1, {})->empty());
}

}  // namespace
}  // namespace veneer::planner
