// Labels made into pieces that can be cut.
#include "planner/layout/fabricable_partition.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

constexpr FabricationLimits kLimits{1.5_mm, SquareMillimetres(4)};

// A cell of random sites: regions of all sizes, and specks.
cv::Mat random_labels(cv::Size size, int sites, int specks, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat seeds(size, CV_8UC1, cv::Scalar(255)), distance, labels;
  for (int i = 0; i < sites; ++i) {
    const cv::Point site{random.uniform(0, size.width), random.uniform(0, size.height)};
    seeds.at<std::uint8_t>(site) = 0;
  }
  cv::distanceTransform(seeds, distance, labels, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  for (int i = 0; i < specks; ++i) {
    const cv::Point middle{random.uniform(0, size.width), random.uniform(0, size.height)};
    const cv::Size axes{random.uniform(0, 9), random.uniform(0, 9)};
    const int turn = random.uniform(0, 180), label = 1000 + random.uniform(0, 5), width = random.uniform(1, 3);
    cv::ellipse(labels, middle, axes, turn, 0, 360, cv::Scalar(label), width);
  }
  return labels;
}

RC_GTEST_PROP(FabricablePartition, OfAnyLabelsCoversTheArtworkInPiecesThatCanBeCut, ()) {
  const cv::Size size{*rc::gen::inRange(20, 200), *rc::gen::inRange(20, 200)};
  const int sites = *rc::gen::inRange(1, 60), specks = *rc::gen::inRange(0, 12);
  const cv::Mat labels = random_labels(size, sites, specks, *rc::gen::arbitrary<std::uint64_t>());
  const double mm_per_px = *rc::gen::inRange(20, 70) / 100.0;
  const Millimetres width(size.width * mm_per_px), height(size.height * mm_per_px * 1.01);
  const Smoothness smoothness = *rc::gen::element(Smoothness::kG0, Smoothness::kG1);
  const FabricableOptions options{kLimits, 10_mm, smoothness, 2};
  const Result<Partition> partition = fabricable_partition(labels.clone(), width, height, options);
  RC_ASSERT(partition.ok());
  expect_exact_cover(*partition);
  expect_fabricable(*partition, kLimits);
  const FabricableOptions alone{kLimits, 10_mm, smoothness, 1};
  RC_ASSERT(*fabricable_partition(labels.clone(), width, height, alone) == *partition);
}

}  // namespace
}  // namespace veneer::planner
