#include "planner/pictures/tone_mapping.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

// A spot, a patch wide, a little darker than the plain cheek around it.
cv::Mat cheek_with_spot() {
  cv::Mat out(200, 200, CV_32FC1, cv::Scalar(0.6));
  cv::circle(out, {100, 100}, 10, cv::Scalar(0.5), cv::FILLED);
  return out;
}

GreyHistogram wood_from(double dark, double pale) {
  cv::Mat tones(1, 256, CV_32FC1);
  for (int c = 0; c < 256; ++c) tones.at<float>(0, c) = static_cast<float>(dark + (pale - dark) * c / 255);
  GreyHistogram out;
  out.add(tones);
  return out;
}

TEST(ToneMapping, WhatIsAsLargeAsAPatchIsSetOff) {
  const cv::Mat before = cheek_with_spot(), after = set_off(before, Pixels(20), 1);
  const auto at = [](const cv::Mat& m, int x, int y) { return static_cast<double>(m.at<float>(y, x)); };
  EXPECT_LT(at(after, 100, 100), 0.43);
  EXPECT_NEAR(at(after, 5, 5), 0.6, 0.005);
  EXPECT_GT(at(after, 128, 100), 0.6);  // its surroundings become a little paler
  // In patches much larger than the spot there is no room for it.
  EXPECT_GT(at(set_off(before, Pixels(150), 1), 100, 100), 0.44);
}

TEST(ToneMapping, NothingIsDoneUnlessAskedFor) {
  const cv::Mat before = cheek_with_spot();
  EXPECT_EQ(set_off(before, Pixels(20), 0).data, before.data);
  EXPECT_EQ(stretch_tones(before, wood_from(0.1, 0.9), 0).data, before.data);
  EXPECT_EQ(stretch_tones(before, GreyHistogram(), 1).data, before.data);
}

TEST(ToneMapping, APalePictureUsesTheWholeOfTheWood) {
  cv::Mat pale(20, 256, CV_32FC1);
  for (int c = 0; c < 256; ++c) pale.col(c).setTo(0.5 + 0.4 * c / 255);
  const cv::Mat laid = stretch_tones(pale, wood_from(0.1, 0.8), 1);
  double dark = 0, bright = 0;
  cv::minMaxLoc(laid, &dark, &bright);
  EXPECT_NEAR(dark, 0.12, 0.02);
  EXPECT_NEAR(bright, 0.78, 0.02);
  EXPECT_NEAR(static_cast<double>(laid.at<float>(10, 128)), 0.45, 0.02);  // evenly
  const cv::Mat half = stretch_tones(pale, wood_from(0.1, 0.8), 0.5);
  EXPECT_NEAR(static_cast<double>(half.at<float>(10, 0)), (0.5 + dark) / 2, 0.01);
}

TEST(ToneMapping, APlainPictureStaysPlain) {
  const cv::Mat plain(30, 30, CV_32FC1, cv::Scalar(0.7));
  EXPECT_EQ(cv::norm(stretch_tones(plain, wood_from(0.1, 0.8), 1), plain, cv::NORM_INF), 0);
  EXPECT_LT(cv::norm(set_off(plain, Pixels(8), 1), plain, cv::NORM_INF), 1e-5);
}

}  // namespace
}  // namespace veneer::planner
