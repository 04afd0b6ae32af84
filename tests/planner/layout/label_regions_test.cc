// Labels cleaned: what is small, surrounds another, hangs by a neck or lies astray.
#include "planner/layout/label_regions.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

RC_GTEST_PROP(LabelRegions, AreSimplyConnectedAndNumberedInReadingOrder, ()) {
  const cv::Size size{*rc::gen::inRange(1, 40), *rc::gen::inRange(1, 40)};
  cv::Mat labels(size, CV_32SC1);
  cv::RNG random(*rc::gen::arbitrary<std::uint64_t>());
  random.fill(labels, cv::RNG::UNIFORM, 0, *rc::gen::inRange(1, 6));
  const int count = clean_regions(labels, {3, 6});
  int next = 0;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      RC_ASSERT(labels.at<int>(r, c) <= next);
      next = std::max(next, labels.at<int>(r, c) + 1);
    }
  RC_ASSERT(next == count);
  for (int region = 0; region < count; ++region) {
    cv::Mat mask, numbers;
    cv::copyMakeBorder(labels == region, mask, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
    RC_ASSERT(cv::connectedComponents(mask, numbers, 4) == 2);
    RC_ASSERT(cv::connectedComponents(~mask, numbers, 4) == 2);
  }
}

TEST(LabelRegions, SmallPartsGoToTheNeighbourWithTheLongestBorder) {
  cv::Mat labels(30, 30, CV_32SC1, cv::Scalar(0));
  labels.colRange(20, 30).setTo(1);
  labels(cv::Rect(18, 10, 5, 3)).setTo(2);  // 3 of its pixels look to the left, 3 to the right; above and below 2 to 3
  EXPECT_EQ(clean_regions(labels, {0, 20}), 2);
  EXPECT_EQ(labels.at<int>(11, 20), 1);
}

TEST(LabelRegions, WhatSurroundsAnotherIsCutInTwo) {
  cv::Mat labels(60, 60, CV_32SC1, cv::Scalar(0));
  labels(cv::Rect(20, 20, 20, 20)).setTo(1);
  EXPECT_EQ(clean_regions(labels, {4, 20}), 3);
  EXPECT_EQ(labels.at<int>(30, 30), labels.at<int>(22, 22));
}

TEST(LabelRegions, WhatTookInAnotherStays) {
  cv::Mat labels(10, 30, CV_32SC1, cv::Scalar(0));
  labels.colRange(10, 14).setTo(1);
  labels.colRange(14, 18).setTo(2);
  labels.colRange(18, 30).setTo(3);
  labels(cv::Rect(14, 0, 4, 1)).setTo(1);  // so that region 2 has its longest border with 1
  absorb_regions(labels, {2, 1});
  EXPECT_EQ(labels.at<int>(5, 12), 1) << "it is larger now, and asked about again";
  EXPECT_EQ(labels.at<int>(5, 16), 1);
}

TEST(LabelRegions, ANeckIsCutThrough) {
  cv::Mat labels(40, 80, CV_32SC1, cv::Scalar(0));
  labels(cv::Rect(5, 5, 30, 30)).setTo(1);
  labels(cv::Rect(45, 5, 30, 30)).setTo(1);
  labels(cv::Rect(35, 19, 10, 2)).setTo(1);
  clean_regions(labels, {5, 20});
  EXPECT_NE(labels.at<int>(20, 20), labels.at<int>(20, 60));
}

TEST(LabelRegions, StrayPartsDoNotComeBackOverABarrier) {
  cv::Mat labels(20, 30, CV_32SC1, cv::Scalar(0)), barrier(20, 30, CV_8UC1, cv::Scalar(0));
  labels.colRange(15, 30).setTo(1);
  barrier.col(12).setTo(255);  // cuts three columns off the left region
  absorb_stray_parts(labels, barrier);
  EXPECT_EQ(labels.at<int>(5, 5), labels.at<int>(5, 11));
  EXPECT_EQ(labels.at<int>(5, 13), labels.at<int>(5, 20));
  EXPECT_NE(labels.at<int>(5, 11), labels.at<int>(5, 13));
}

// A strip between two barriers, open at its lower end alone.
TEST(LabelRegions, StrayPartsGoOverABarrierOnlyWhereTheyMust) {
  cv::Mat labels(20, 40, CV_32SC1, cv::Scalar(0)), barrier(20, 40, CV_8UC1, cv::Scalar(0));
  labels.colRange(15, 40).setTo(1);
  labels.rowRange(17, 20).setTo(2);
  for (const int c : {12, 15}) barrier(cv::Rect(c, 0, 1, 18)).setTo(255);
  cv::Mat closed = labels.clone();
  absorb_stray_parts(labels, barrier);
  EXPECT_EQ(labels.at<int>(5, 13), labels.at<int>(19, 13)) << "not to the right, where its border is longer";
  barrier.row(17).setTo(255);
  absorb_stray_parts(closed, barrier);
  EXPECT_EQ(closed.at<int>(5, 13), closed.at<int>(5, 30)) << "there is no other way";
}

}  // namespace
}  // namespace veneer::planner
