#include "daemon/orders/kept_edges.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

class KeptEdges : public ::testing::Test {
 protected:
  // Counts how often edges are found.
  cv::Mat edges_of(const cv::Mat& bgr, double spacing, planner::GridEffort effort = planner::GridEffort::kFine) {
    return kept_edges(folder_ / "edges", effort, [this](const cv::Mat& pixels, double of, int threads) {
      ++found_;
      return planner::all_edges(pixels, of, threads);
    })(bgr, spacing, 1);
  }
  // Of no look at the pixels.
  planner::EdgeFinder kept(planner::GridEffort effort) {
    return kept_edges(folder_ / "edges", effort, [this](const cv::Mat& pixels, double, int) {
      ++found_;
      return cv::Mat(pixels.size(), CV_8UC1, cv::Scalar(planner::kLargeLevel));
    });
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> out;
    for (const auto& entry : fs::directory_iterator(folder_ / "edges")) out.push_back(entry.path());
    return out;
  }
  static bool same(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

  const cv::Mat picture_ = planner::test::wood_picture(120, 90, 7);
  testing::TempDirectory folder_;
  int found_ = 0;
};

TEST_F(KeptEdges, AreFoundOnceAndTheSameFromThenOn) {
  const cv::Mat first = edges_of(picture_, 12), again = edges_of(picture_.clone(), 12);
  EXPECT_EQ(found_, 1);
  ASSERT_GT(cv::countNonZero(first), 0);
  EXPECT_TRUE(same(first, again));
  EXPECT_TRUE(same(again, planner::all_edges(picture_, 12, 1)));
}

TEST_F(KeptEdges, OfAnotherPictureOrSpacingAreItsOwn) {
  edges_of(picture_, 12);
  cv::Mat other = picture_.clone();
  for (const double spacing : {12.0, 12.0000001, 13.0}) {
    other.at<cv::Vec3b>(5, 5)[0] ^= 1;  // one bit of one pixel
    const int before = found_;
    EXPECT_TRUE(same(edges_of(other, spacing), planner::all_edges(other, spacing, 1))) << spacing;
    EXPECT_EQ(found_, before + 1) << spacing;
  }
  const cv::Mat wide = picture_.reshape(3, picture_.rows * 2);  // the same bytes
  EXPECT_TRUE(same(edges_of(wide, 12), planner::all_edges(wide, 12, 1)));
}

TEST_F(KeptEdges, OfAPartOfAPictureAreThoseOfItsPixels) {
  const cv::Mat part = picture_(cv::Rect(10, 10, 80, 60));
  ASSERT_FALSE(part.isContinuous());
  for (int time = 0; time < 2; ++time) EXPECT_TRUE(same(edges_of(part, 12), planner::all_edges(part.clone(), 12, 1)));
  EXPECT_EQ(found_, 1);
}

TEST_F(KeptEdges, ThatWereSpoiltAreFoundAnew) {
  const cv::Mat first = edges_of(picture_, 12);
  ASSERT_EQ(files().size(), 1U);
  std::fstream file(files().front(), std::ios::in | std::ios::out | std::ios::binary | std::ios::ate);
  file.seekp(-100, std::ios::end);
  file.put(15);
  file.close();
  EXPECT_TRUE(same(edges_of(picture_, 12), first));
  EXPECT_EQ(found_, 2);
  EXPECT_TRUE(same(edges_of(picture_, 12), first));
  EXPECT_EQ(found_, 2) << "and kept again";
}

TEST_F(KeptEdges, TakeNoMoreRoomHoweverManyPicturesThereWere) {
  for (int n = 0; n < 100; ++n) {
    kept(planner::GridEffort::kCoarse)(picture_, 8 + n, 1);
    kept(planner::GridEffort::kFine)(picture_, 8 + n, 1);
  }
  EXPECT_LE(files().size(), kKeptEdges);
}

// As New picture asks: the coarse grid while a hand moves, the fine one once it rests.
TEST_F(KeptEdges, OfTheCoarseGridLeaveThoseOfTheFineOneWhereTheyAre) {
  const cv::Mat small = picture_(cv::Rect(0, 0, 60, 45)).clone();
  for (int n = 0; n < 100; ++n) {
    found_ = 0;
    for (int time = 0; time < 2; ++time) {
      kept(planner::GridEffort::kCoarse)(small, 4 + n, 1);
      kept(planner::GridEffort::kFine)(picture_, 8 + n, 1);
    }
    EXPECT_EQ(found_, 2) << n;
  }
}

// As on a full disk: what makes room is wanted there most.
TEST_F(KeptEdges, WhatAKilledOneLeftGoesAlsoWhereNothingIsStored) {
  edges_of(picture_, 12);
  ASSERT_EQ(files().size(), 1U);
  const fs::path name = files().front();
  fs::remove(name);
  fs::create_directories(name / "in the way");
  const auto leave = [&](const char* process, std::chrono::minutes age) {
    const fs::path left = fs::path(name) += process;
    std::ofstream(left) << "half";
    fs::last_write_time(left, fs::file_time_type::clock::now() - age);
    return left;
  };
  const fs::path old = leave(".1", std::chrono::minutes(61)), recent = leave(".2", std::chrono::minutes(59));
  edges_of(picture_, 12);
  ASSERT_EQ(found_, 2);
  ASSERT_TRUE(fs::is_directory(name)) << "so that nothing was stored";
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(recent)) << "somebody may be writing it";
}

TEST_F(KeptEdges, AreFoundEachTimeWhereNothingCanBeKept) {
  std::ofstream(folder_ / "edges") << "no folder";
  const cv::Mat first = edges_of(picture_, 12);
  EXPECT_TRUE(same(edges_of(picture_, 12), first));
  EXPECT_EQ(found_, 2);
}

}  // namespace
}  // namespace veneer::daemon
