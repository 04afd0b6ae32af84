#include "planner/pictures/features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/pictures/histogram.h"

namespace veneer::planner {
namespace {

FilterInput seen(const cv::Mat& grey, const cv::Mat& intensity = {}) {
  cv::Mat bytes, bgr;
  grey.convertTo(bytes, CV_8U, 255);
  cv::cvtColor(bytes, bgr, cv::COLOR_GRAY2BGR);
  return {bgr, grey, intensity.empty() ? grey : intensity, ScanResolution{2}};
}

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
  cv::minMaxLoc(filter_bank(seen(grey), options).reshape(1), nullptr, &most);
  EXPECT_GT(most, 0.9);
  EXPECT_LE(most, largest_response(options));
}

TEST(Features, AChannelWithoutWeightIsLeftOut) {
  const cv::Mat grey(3, 3, CV_32FC1, cv::Scalar(0.5));
  PlanOptions options;
  options.w_edge = 0, options.w_intensity = 0.25;
  const cv::Mat responses = filter_bank(seen(grey), options);
  EXPECT_EQ(responses.channels(), 1);
  EXPECT_FLOAT_EQ(responses.at<float>(1, 1), 0.125F);
}

TEST(Features, EdgesComeFromTheUnmappedPicture) {
  cv::Mat mapped(3, 4, CV_32FC1, cv::Scalar(0.5)), grey = mapped.clone();
  grey.colRange(2, 4) = 1;
  PlanOptions options;
  const cv::Mat responses = filter_bank(seen(grey, mapped), options);
  EXPECT_FLOAT_EQ(responses.at<cv::Vec2f>(1, 1)[0], 0.25F);
  EXPECT_FLOAT_EQ(responses.at<cv::Vec2f>(1, 1)[1], 0.25F);
}

TEST(Features, AStepKeepsEdgeOneAtAnyScale) {
  cv::Mat grey(60, 80, CV_32FC1, cv::Scalar(0));
  grey.colRange(40, 80) = 1;
  for (const double sigma : {0.0, 1.0, 2.5, 6.0}) {
    double most = 0;
    cv::minMaxLoc(edges_at_scale(grey, Pixels(sigma)), nullptr, &most);
    EXPECT_NEAR(most, 1, 0.05) << sigma;
  }
}

TEST(Features, EdgesAtACoarseScaleOverlookGrain) {
  cv::Mat grain(40, 40, CV_32FC1);
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c) grain.at<float>(r, c) = 0.5F + 0.1F * static_cast<float>(c / 2 % 2);
  EXPECT_GT(cv::mean(edges_at_scale(grain, Pixels(0)))[0], 0.05);
  EXPECT_LT(cv::mean(edges_at_scale(grain, Pixels(4)))[0], 0.01);
}

// What makes it right to sample the maps of a panel instead of turning its picture.
TEST(Features, EveryFilterTurnsWithThePicture) {
  cv::RNG random(11);
  cv::Mat picture(48, 48, CV_8UC3), turned;
  random.fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {}, 2);
  cv::rotate(picture, turned, cv::ROTATE_90_CLOCKWISE);
  PlanOptions options;
  options.w_intensity = options.w_edge = options.w_colour = options.w_texture = 1, options.edge = 1_mm;
  const auto bank = [&](const cv::Mat& of) {
    const cv::Mat grey = grey_of(of);
    return filter_bank({of, grey, grey, ScanResolution{4}}, options);
  };
  cv::Mat expected;
  cv::rotate(bank(picture), expected, cv::ROTATE_90_CLOCKWISE);
  const cv::Mat got = bank(turned);
  ASSERT_EQ(got.channels(), 6);
  EXPECT_LT(cv::norm(got, expected, cv::NORM_INF), 1e-4);
  double least = 0, most = 0;
  cv::minMaxLoc(got.reshape(1), &least, &most);
  EXPECT_GE(least, 0);
  EXPECT_LE(most, largest_response(options));
}

// A picture wider than a band is filtered row by row: as if it were filtered whole.
TEST(Features, BandsOfRowsDoNotShow) {
  cv::RNG random(12);
  cv::Mat picture(23, 270000, CV_8UC3);
  random.fill(picture, cv::RNG::UNIFORM, 0, 255);
  const cv::Mat grey = grey_of(picture);
  PlanOptions options;
  options.w_intensity = options.w_edge = 1, options.edge = 0.5_mm;
  std::vector<cv::Mat> planes;
  cv::split(filter_bank({picture, grey, grey, ScanResolution{4}}, options), planes);
  ASSERT_EQ(planes.size(), 2U);
  EXPECT_EQ(cv::norm(planes[0], grey, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(planes[1], edges_at_scale(grey, Pixels(2)), cv::NORM_INF), 0);

  // All filters there are, against a part of the picture that is narrow enough for one band.
  options.w_colour = options.w_texture = 1;
  const cv::Rect narrow(1000, 0, 3000, 23), inside(100, 0, 2800, 23);
  const cv::Mat all = filter_bank({picture, grey, grey, ScanResolution{4}}, options);
  const cv::Mat part =
      filter_bank({picture(narrow).clone(), grey(narrow).clone(), grey(narrow).clone(), ScanResolution{4}}, options);
  ASSERT_GT(all.channels(), 3);
  EXPECT_LT(cv::norm(all(narrow)(inside).clone().reshape(1), part(inside).clone().reshape(1), cv::NORM_INF), 1e-5);
}

TEST(Features, ColourIsADistanceInCielab) {
  cv::Mat pair(1, 2, CV_8UC3);
  pair.at<cv::Vec3b>(0, 0) = {40, 80, 160};  // BGR: a reddish brown
  pair.at<cv::Vec3b>(0, 1) = {90, 90, 90};
  PlanOptions options;
  options.w_intensity = options.w_edge = 0, options.w_colour = 1;
  const cv::Mat grey = grey_of(pair);
  const cv::Mat responses = filter_bank({pair, grey, grey, ScanResolution{4}}, options);
  // By CIE's formulas the brown has a* = 30.2, b* = 37.8; grey has neither.
  const cv::Vec2f brown = responses.at<cv::Vec2f>(0, 0), plain = responses.at<cv::Vec2f>(0, 1);
  EXPECT_NEAR(brown[0] - plain[0], 0.302, 0.002);
  EXPECT_NEAR(brown[1] - plain[1], 0.378, 0.002);
}

TEST(Features, TextureTellsLinesFromPlainWood) {
  cv::Mat plain(60, 60, CV_32FC1, cv::Scalar(0.5)), lines = plain.clone();
  for (int c = 2; c < 60; c += 8) lines.colRange(c, c + 2) = 0.2;
  PlanOptions options;
  options.w_intensity = options.w_edge = 0, options.w_texture = 1;
  const auto bar = [&](const cv::Mat& grey) {
    return filter_bank({seen(grey).bgr, grey, grey, ScanResolution{8}}, options).at<cv::Vec2f>(30, 30)[0];
  };
  EXPECT_LT(bar(plain), 0.001);
  EXPECT_GT(bar(lines), 0.05);
}

TEST(Features, WeightsAreCheckedByName) {
  PlanOptions options;
  EXPECT_TRUE(check_weights(options).ok());
  options.w_colour = 1.5;
  EXPECT_NE(check_weights(options).error().message.find("colour weight"), std::string::npos);
  options.w_colour = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(check_weights(options).ok());
  options.w_colour = options.w_intensity = options.w_edge = 0;
  EXPECT_FALSE(check_weights(options).ok());
  options.w_texture = 0.1;
  EXPECT_TRUE(check_weights(options).ok());
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

TEST(Histogram, WoodCountsByAreaTimesWeight) {
  GreyHistogram source;
  source.add(greys({100, 100}), {}, 3);
  source.add(greys({200, 200}), {}, 1);
  EXPECT_DOUBLE_EQ(source.total(), 8);
  // Three quarters of the wood are dark: so are three quarters of the picture.
  const cv::Mat matched = match_tones(greys({10, 20, 30, 40}), source, 1);
  EXPECT_NEAR(matched.at<float>(0, 2) * 255, 100, 0.01);
  EXPECT_NEAR(matched.at<float>(0, 3) * 255, 200, 0.01);
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
