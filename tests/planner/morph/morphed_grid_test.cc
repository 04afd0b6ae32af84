// A-priori grid morphing: what is an edge, where springs draw vertices, where lines come to lie, what can be cut.
#include "planner/morph/morphed_grid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/hash.h"
#include "planner/layout/grid.h"
#include "planner/morph/edge_image.h"
#include "planner/morph/spring_grid.h"
#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

constexpr int kSide = 200;  // pixels of drawn pictures: two a millimetre
const PixelGrid kWork{{2}, 100_mm};

MorphOptions morph_options(Millimetres patch, int threads = 1) {
  return {patch, {1.5_mm, patch * patch * 0.25}, std::min(5_mm, patch / 2), Smoothness::kG0, threads};
}

Result<MorphedGrid> morphed(const cv::Mat& bgr, const MorphOptions& options, const std::stop_token& stop = {}) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  return morphed_grid(bgr, grey, 100_mm, kWork, options, stop);
}

// Dark on the left, pale on the right of a line from the upper to the lower border.
cv::Mat step(double top, double bottom) {
  cv::Mat out(kSide, kSide, CV_8UC3, cv::Scalar::all(60));
  for (int r = 0; r < kSide; ++r)
    for (int c = 0; c < kSide; ++c)
      if (c > top + (bottom - top) * r / kSide) out.at<cv::Vec3b>(r, c) = {200, 200, 200};
  return out;
}

cv::Mat shapes(std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat out(kSide, kSide, CV_8UC3, cv::Scalar::all(random.uniform(0, 256)));
  for (int i = 0; i < 12; ++i) {
    const int tone = random.uniform(0, 256), turn = random.uniform(0, 180);
    const cv::Size axes{random.uniform(2, 70), random.uniform(2, 70)};
    const cv::Point middle{random.uniform(0, kSide), random.uniform(0, kSide)};
    cv::ellipse(out, middle, axes, turn, 0, 360, cv::Scalar::all(tone), cv::FILLED);
  }
  return out;
}

TEST(RollingGuidance, TakesSpecksAndKeepsSteps) {
  cv::Mat grey(60, 60, CV_8UC1, cv::Scalar(60));
  grey.colRange(30, 60).setTo(200);
  grey(cv::Rect(10, 10, 2, 2)).setTo(200);
  const cv::Mat out = rolling_guidance(grey, 3, 25, 2);
  EXPECT_NEAR(out.at<std::uint8_t>(11, 11), 60, 12);
  EXPECT_NEAR(out.at<std::uint8_t>(40, 28), 60, 12);
  EXPECT_NEAR(out.at<std::uint8_t>(40, 31), 200, 12);
}

TEST(EdgeImage, CountsWhereItsMasksSay) {
  // Four kinds in two columns; only the left one counts for some.
  const std::vector<std::uint8_t> kinds{kLargeUpright, kLargeUpright, kLargeLevel, kLargeLevel,
                                        kFineUpright,  kFineUpright,  kFineLevel,  kFineLevel};
  const cv::Mat all = cv::Mat(kinds, true).reshape(1, 4), before = all.clone();
  cv::Mat left(all.size(), CV_8UC1, cv::Scalar(0));
  left.col(0).setTo(1);
  const auto count = [&](const EdgeMasks& masks) {
    const EdgeImage out = edges_that_count(all, masks);
    std::vector<std::vector<int>> found;
    for (const cv::Mat& edges : {out.upright, out.level}) {
      auto& rows = found.emplace_back();
      for (int r = 0; r < edges.rows; ++r) rows.push_back(cv::countNonZero(edges.row(r)));
    }
    EXPECT_EQ(cv::norm(all, before, cv::NORM_INF), 0) << "which is asked again";
    return found;
  };
  using Counts = std::vector<std::vector<int>>;
  EXPECT_EQ(count({}), (Counts{{2, 0, 2, 0}, {0, 2, 0, 2}}));
  EXPECT_EQ(count({left, {}}), (Counts{{1, 0, 2, 0}, {0, 1, 0, 2}}));
  EXPECT_EQ(count({{}, left}), (Counts{{2, 0, 1, 0}, {0, 2, 0, 1}}));
  EXPECT_EQ(count({left, left}), (Counts{{1, 0, 1, 0}, {0, 1, 0, 1}}));
}

constexpr bool kIsX86 =
#ifdef __x86_64__
    true;
#else
    false;
#endif

// Edges are kept from one program to the next (daemon/orders/kept_edges.h), and asked for by this number. What OpenCV
// makes of a pixel may be another thing by a bit in another version of it or on another processor, with the same
// filters: so the hash is one of the version and the architecture that it was written down on, and compared only there.
TEST(EdgeImage, OtherFiltersHaveAnotherNumber) {
  ASSERT_EQ(kEdgeFilters, 1) << "the number that the hash below was written down for";
  constexpr const char* kOpenCv = "4.6.0";
  if (cv::getVersionString() != kOpenCv || !kIsX86)
    GTEST_SKIP() << "the hash was written down for OpenCV " << kOpenCv << " on x86-64, and this is OpenCV "
                 << cv::getVersionString() << (kIsX86 ? "" : " on another architecture")
                 << ": whether the edges are the same is not tested here";
  cv::Mat picture = step(72, 88);
  for (int n = 0; n < 12; ++n) picture(cv::Rect(8 + 15 * n, 150, 3 + n, 3 + n)).setTo(cv::Scalar::all(20 * n));
  const cv::Mat all = all_edges(picture, 20, 1);
  ASSERT_TRUE(all.isContinuous());
  EXPECT_EQ(sha256_hex(std::as_bytes(std::span(all.data, all.total()))),
            "aa5a321ca9a6d1f3be1ef117950bb77bcb1f505d135b6957b564ce9d32d79956")
      << "if these edges are meant, give kEdgeFilters another number, and write it and them down here";
}

TEST(SpringGrid, VerticesGoToTheEdgeAndThoseOfTheBorderSlideAlongIt) {
  const EdgeImage edges = edge_image(step(72, 88), 40, 1);
  const SpringGrid grid = spring_grid({5, 5}, kSide, kSide, edges);
  for (int r = 0; r <= 5; ++r) {
    EXPECT_NEAR(grid.at(r, 2).x, 72 + 16 * grid.at(r, 2).y / kSide, 2.5) << r;
    EXPECT_EQ(grid.at(r, 0).x, 0);
    EXPECT_EQ(grid.at(r, 5).x, kSide);
  }
  for (int c = 0; c <= 5; ++c) EXPECT_EQ(grid.at(0, c).y, 0);
  EXPECT_EQ(grid.at(0, 0), (PlanePoint{0, 0}));
}

TEST(MorphedGrid, ALineFollowsASlantedEdge) {
  const Result<MorphedGrid> made = morphed(step(72, 88), morph_options(20_mm));
  ASSERT_TRUE(made.ok());
  EXPECT_LT(made->figures.edges_before, 0.3);
  EXPECT_GT(made->figures.edges_after, 0.9);
  EXPECT_GT(made->figures.most_move, 2_mm);
  const CutLine& line = made->lines.lines[1];
  for (double row = 0; row < kSide; row += 5) EXPECT_NEAR(line(row), 72 + 16 * row / kSide, 1.2) << row;
}

TEST(MorphedGrid, OfAFlatPictureIsTheGridToTheLastBit) {
  const Result<MorphedGrid> made =
      morphed(cv::Mat(kSide, kSide, CV_8UC3, cv::Scalar(90, 120, 150)), morph_options(13_mm));
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->partition, partition_of(100_mm, 100_mm, grid_layout(100_mm, 100_mm, 13_mm)));
  EXPECT_EQ(made->figures.most_move, 0_mm);
}

// Eight bits draw a soft slope in steps of one grey level, long and clean.
TEST(MorphedGrid, OfASoftSlopeHasNoEdges) {
  cv::Mat slope(kSide, kSide, CV_8UC3);
  for (int c = 0; c < kSide; ++c) slope.col(c).setTo(cv::Scalar::all(100 + std::floor(40.0 * c / kSide)));
  MorphOptions options = morph_options(13_mm);
  const Result<MorphedGrid> made = morphed(slope, options);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->figures.most_move, 0_mm);
}

TEST(MorphedGrid, OfSquaresThatAreTooSmallIsTheGrid) {
  MorphOptions options = morph_options(4_mm);
  options.limits.width = 5_mm;
  const Result<MorphedGrid> made = morphed(shapes(2), options);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->partition, partition_of(100_mm, 100_mm, grid_layout(100_mm, 100_mm, 4_mm)));
}

TEST(MorphedGrid, EndsWhenItIsAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  const Result<MorphedGrid> made = morphed(shapes(1), morph_options(14_mm), stop.get_token());
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::kCancelled);
}

RC_GTEST_PROP(MorphedGrid, OfAnyPictureCanBeCutAndDoesNotDependOnThreads, ()) {
  const cv::Mat picture = shapes(*rc::gen::arbitrary<std::uint64_t>());
  MorphOptions options = morph_options(Millimetres(*rc::gen::inRange(9, 40)));
  options.smoothness = *rc::gen::element(Smoothness::kG0, Smoothness::kG1);
  const Result<MorphedGrid> made = morphed(picture, options);
  RC_ASSERT(made.ok());
  expect_exact_cover(made->partition);
  expect_fabricable(made->partition, options.limits);
  const GridSize size = grid_size(100_mm, 100_mm, options.patch);
  RC_ASSERT(made->partition.faces.size() == static_cast<std::size_t>(size.rows * size.columns));
  options.threads = 3;
  const Result<MorphedGrid> again = morphed(picture, options);
  RC_ASSERT(again->partition == made->partition);
  RC_ASSERT(again->figures == made->figures);
}

}  // namespace
}  // namespace veneer::planner
