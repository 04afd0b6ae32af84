// Areas of a picture by its tones.
#include "planner/layout/tone_areas.h"

#include <gtest/gtest.h>

#include <array>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::planner {
namespace {

TEST(ToneGroups, LieWhereThePicturesTonesDo) {
  std::array<double, 256> histogram{};
  for (const int tone : {20, 22, 120, 124, 230}) histogram[static_cast<std::size_t>(tone)] = 100;
  const std::vector<int> ends = tone_groups(histogram, 3);
  ASSERT_EQ(ends.size(), 3U);
  EXPECT_TRUE(ends[0] >= 22 && ends[0] < 120) << ends[0];
  EXPECT_TRUE(ends[1] >= 124 && ends[1] < 230) << ends[1];
  EXPECT_EQ(ends[2], 255);
  histogram.fill(0);
  histogram[20] = histogram[120] = 250, histogram[200] = 9500;  // a ground that is nearly all of the picture
  const std::vector<int> parted = tone_groups(histogram, 6);
  ASSERT_EQ(parted.size(), 3U);
  EXPECT_TRUE(parted[0] >= 20 && parted[0] < 120 && parted[1] >= 120 && parted[1] < 200) << parted[0];
  histogram.fill(0);
  histogram[90] = 7;  // a plain picture
  EXPECT_EQ(tone_groups(histogram, 6), std::vector<int>{255});
}

TEST(ToneAreas, AreWhatIsNotMuchSmallerThanAPatch) {
  cv::Mat picture(120, 120, CV_8UC3, cv::Scalar::all(200));
  cv::circle(picture, {60, 60}, 30, cv::Scalar::all(60), cv::FILLED);
  cv::circle(picture, {20, 20}, 2, cv::Scalar::all(60), cv::FILLED);  // a speck
  const cv::Mat areas = tone_areas(picture, 20, 2);
  EXPECT_EQ(areas.at<int>(60, 60), 0);
  EXPECT_EQ(areas.at<int>(20, 20), 1);
  EXPECT_EQ(areas.at<int>(60, 100), 1);
  EXPECT_NEAR(static_cast<double>(areas.total()) - cv::countNonZero(areas), 3.1416 * 30 * 30, 150);
}

}  // namespace
}  // namespace veneer::planner
