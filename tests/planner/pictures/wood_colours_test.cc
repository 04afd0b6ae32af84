#include "planner/pictures/wood_colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/pictures/features.h"

namespace veneer::planner {
namespace {

// Of a lightness (0 to 100) and colour, as 8-bit pixels.
cv::Vec3b bgr_of(double lightness, double a, double b) {
  cv::Mat lab(1, 1, CV_32FC3, cv::Scalar(lightness, a, b)), bgr, out;
  cv::cvtColor(lab, bgr, cv::COLOR_Lab2BGR);
  bgr.convertTo(out, CV_8UC3, 255);
  return out.at<cv::Vec3b>(0, 0);
}

// A ramp of lightness along x, of one colour.
cv::Mat ramp(int columns, int rows, double from, double to, double a, double b) {
  cv::Mat out(rows, columns, CV_8UC3);
  for (int c = 0; c < columns; ++c) out.col(c).setTo(bgr_of(from + (to - from) * c / columns, a, b));
  return out;
}

void count(ColourCounts& counts, const cv::Mat& bgr) { ASSERT_TRUE(counts.add(bgr, grey_of(bgr), {}, 1, {}).ok()); }

// Three quarters of the wood are tan, from dark to pale; the rest is red and of the tones in the middle.
ColourCounts tan_and_red() {
  ColourCounts out;
  count(out, ramp(300, 60, 15, 90, 8, 24));
  count(out, ramp(100, 60, 38, 52, 42, 34));
  return out;
}

double far(const cv::Vec2f& a, double x, double y) { return std::hypot(a[0] - x, a[1] - y); }

TEST(WoodColours, TheToneLineKeepsToWhereMostOfTheWoodIs) {
  const ToneLine line = tone_line(tan_and_red());
  for (const float tone : {0.2F, 0.35F, 0.45F, 0.6F, 0.85F}) EXPECT_LT(far(line.at(tone), 8, 24), 6) << tone;
}

TEST(WoodColours, WithoutAnyWoodAllIsGrey) {
  const ToneLine line = tone_line(ColourCounts());
  EXPECT_EQ(line.at(0.5F), cv::Vec2f(0, 0));
  EXPECT_EQ(line.spread, 0);
  EXPECT_EQ(tones_near(ColourCounts(), line, 1).total(), 0);
}

TEST(WoodColours, AGreyPictureLooksForTheColoursOfTheLine) {
  const cv::Mat picture = ramp(80, 10, 10, 95, 0, 0), grey = grey_of(picture);
  ColourCounts own;
  count(own, picture);
  const cv::Mat wanted = match_colours(chroma_of(picture), grey, grey, mean_line(own), tone_line(tan_and_red()), 1);
  for (int c = 8; c < 80; c += 8) EXPECT_LT(far(wanted.at<cv::Vec2f>(5, c), 8, 24), 8) << c;
}

TEST(WoodColours, WhatIsRedderThanTheRestOfThePictureLooksForRedderWood) {
  cv::Mat picture = ramp(80, 40, 10, 95, 5, 10);
  for (int r = 0; r < 10; ++r)
    for (int c = 30; c < 40; ++c) picture.at<cv::Vec3b>(r, c) = bgr_of(10 + 85 * c / 80.0, 40, 25);
  const cv::Mat grey = grey_of(picture);
  ColourCounts own;
  count(own, picture);
  const cv::Mat wanted = match_colours(chroma_of(picture), grey, grey, mean_line(own), tone_line(tan_and_red()), 1);
  const cv::Vec2f lips = wanted.at<cv::Vec2f>(5, 35), skin = wanted.at<cv::Vec2f>(30, 35);
  EXPECT_GT(lips[0], skin[0] + 5);
  EXPECT_LT(far(skin, 8, 24), 8);
}

TEST(WoodColours, WithoutMappingThePictureLooksForItsOwnColours) {
  const cv::Mat picture = ramp(40, 10, 10, 95, 20, -20), grey = grey_of(picture), own = chroma_of(picture);
  ColourCounts counts;
  count(counts, picture);
  const cv::Mat wanted = match_colours(own, grey, grey, mean_line(counts), tone_line(tan_and_red()), 0);
  EXPECT_EQ(cv::norm(own, wanted, cv::NORM_INF), 0);
}

TEST(WoodColours, TonesOfWoodThatIsFarFromTheLineCountLess) {
  const ColourCounts wood = tan_and_red();
  const ToneLine line = tone_line(wood);
  const GreyHistogram all = tones_near(wood, line, 0), near = tones_near(wood, line, 1);
  EXPECT_NEAR(all.total(), wood.total(), 1e-6 * wood.total());
  // What the tan wood has is left, the red is gone.
  EXPECT_LT(near.total(), 0.8 * all.total());
  EXPECT_GT(near.total(), 0.6 * all.total());
}

}  // namespace
}  // namespace veneer::planner
