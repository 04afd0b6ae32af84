#include "planner/features.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "planner/histogram.h"

namespace veneer::planner {
namespace {

TEST(Features, GreyIsBt601OfTheSrgbValues) {
  cv::Mat picture(1, 4, CV_8UC3);
  picture.at<cv::Vec3b>(0, 0) = {255, 0, 0};
  picture.at<cv::Vec3b>(0, 1) = {0, 255, 0};
  picture.at<cv::Vec3b>(0, 2) = {0, 0, 255};
  picture.at<cv::Vec3b>(0, 3) = {255, 255, 255};
  const cv::Mat grey = grey_of(picture);
  EXPECT_NEAR(grey.at<float>(0, 0), 0.114, 1e-6);
  EXPECT_NEAR(grey.at<float>(0, 1), 0.587, 1e-6);
  EXPECT_NEAR(grey.at<float>(0, 2), 0.299, 1e-6);
  EXPECT_NEAR(grey.at<float>(0, 3), 1, 1e-6);
}

TEST(Features, AnUprightStepHasEdgeOneOnBothItsSides) {
  cv::Mat grey(5, 6, CV_32FC1, cv::Scalar(0));
  grey.colRange(3, 6) = 1;
  const cv::Mat edges = edges_of(grey);
  const float expected[6] = {0, 0, 1, 1, 0, 0};
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(edges.at<float>(2, c), expected[c], 1e-6) << c;
}

TEST(Features, ASlantedSlopeHasTheLengthOfItsGradient) {
  cv::Mat grey(5, 5, CV_32FC1);
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c) grey.at<float>(r, c) = 0.03F * static_cast<float>(c) + 0.04F * static_cast<float>(r);
  // The Sobel kernel sums 8 differences over two pixels: 8 * 0.25 = 2 times the slope per pixel.
  EXPECT_NEAR(edges_of(grey).at<float>(2, 2), 2 * 0.05, 1e-6);
}

TEST(Features, NoResponseExceedsTheLargestOne) {
  cv::Mat grey(4, 4, CV_32FC1, cv::Scalar(0));
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      if (r + c > 3) grey.at<float>(r, c) = 1;
  PlanOptions options;
  options.w_intensity = 0.3, options.w_edge = 1;
  double most = 0;
  cv::minMaxLoc(filter_bank(grey, grey, options).reshape(1), nullptr, &most);
  EXPECT_GT(most, 0.9);
  EXPECT_LE(most, largest_response(options));
}

TEST(Features, AChannelWithoutWeightIsLeftOut) {
  const cv::Mat grey(3, 3, CV_32FC1, cv::Scalar(0.5));
  PlanOptions options;
  options.w_edge = 0, options.w_intensity = 0.25;
  const cv::Mat responses = filter_bank(grey, grey, options);
  EXPECT_EQ(responses.channels(), 1);
  EXPECT_FLOAT_EQ(responses.at<float>(1, 1), 0.125F);
}

TEST(Features, EdgesComeFromTheUnmappedPicture) {
  cv::Mat mapped(3, 4, CV_32FC1, cv::Scalar(0.5)), grey = mapped.clone();
  grey.colRange(2, 4) = 1;
  PlanOptions options;
  const cv::Mat responses = filter_bank(mapped, grey, options);
  EXPECT_FLOAT_EQ(responses.at<cv::Vec2f>(1, 1)[0], 0.25F);
  EXPECT_FLOAT_EQ(responses.at<cv::Vec2f>(1, 1)[1], 0.25F);
}

cv::Mat greys(std::initializer_list<double> values) {
  cv::Mat out(1, static_cast<int>(values.size()), CV_32FC1);
  int i = 0;
  for (const double v : values) out.at<float>(0, i++) = static_cast<float>(v / 255);
  return out;
}

TEST(Histogram, RanksBecomeTheSourcesValuesOfLikeRank) {
  GreyHistogram source;
  source.add(greys({100, 110, 120, 130}));
  const cv::Mat matched = match_tones(greys({0, 80, 160, 240}), source, 1);
  const double expected[4] = {100, 110, 120, 130};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(matched.at<float>(0, i) * 255, expected[i], 0.01) << i;
}

TEST(Histogram, WeightInterpolatesBetweenOriginalAndMatched) {
  GreyHistogram source;
  source.add(greys({100, 110, 120, 130}));
  const cv::Mat matched = match_tones(greys({0, 80, 160, 240}), source, 0.25);
  EXPECT_NEAR(matched.at<float>(0, 3) * 255, 0.75 * 240 + 0.25 * 130, 0.01);
}

TEST(Histogram, OnlyWoodUnderTheMaskCounts) {
  GreyHistogram source;
  cv::Mat mask(1, 4, CV_8UC1, cv::Scalar(255));
  mask.at<std::uint8_t>(0, 0) = 0;
  source.add(greys({0, 110, 110, 110}), mask);
  EXPECT_DOUBLE_EQ(source.total(), 3);
  const cv::Mat matched = match_tones(greys({5, 250}), source, 1);
  EXPECT_NEAR(matched.at<float>(0, 0) * 255, 110, 0.01);
  EXPECT_NEAR(matched.at<float>(0, 1) * 255, 110, 0.01);
}

TEST(Histogram, ASourceMatchedToItselfStaysAsItIs) {
  cv::RNG random(4);
  cv::Mat grey(40, 40, CV_32FC1);
  random.fill(grey, cv::RNG::UNIFORM, 0.1, 0.9);
  GreyHistogram source;
  source.add(grey);
  EXPECT_LT(cv::norm(match_tones(grey, source, 1), grey, cv::NORM_INF), 1.5 / 255);
}

}  // namespace
}  // namespace veneer::planner
