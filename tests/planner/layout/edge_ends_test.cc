// Loose ends of edges, led on.
#include "planner/layout/edge_ends.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

TEST(EdgeEnds, GoOnStraight) {
  cv::Mat edges(60, 80, CV_8UC1, cv::Scalar(0)), longer = edges.clone();
  cv::line(edges, {20, 30}, {50, 30}, cv::Scalar(255));
  cv::line(longer, {12, 30}, {58, 30}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != longer), 0);
  cv::line(edges, {35, 30}, {35, 59}, cv::Scalar(255));  // from its middle to the border
  cv::line(longer, {35, 30}, {35, 59}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != longer), 0);
  edges.setTo(0), longer.setTo(0);
  cv::line(edges, {30, 30}, {40, 20}, cv::Scalar(255));  // aslant
  cv::line(longer, {24, 36}, {46, 14}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 6 * std::sqrt(2.0)) != longer), 0);
  edges.setTo(0);
  cv::circle(edges, {40, 30}, 20, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != edges), 0) << "it has no end";
}

// A stem below a bar, as where the detector of edges lost their crossing: its end is led on to the bar, and not
// through.
TEST(EdgeEnds, AreLedOnAsFarAsTheNextEdge) {
  for (const int gap : {1, 2, 5}) {
    cv::Mat edges(80, 80, CV_8UC1, cv::Scalar(0));
    cv::line(edges, {0, 30}, {79, 30}, cv::Scalar(255));
    cv::Mat longer = edges.clone();
    cv::line(edges, {40, 31 + gap}, {40, 79}, cv::Scalar(255));
    cv::line(longer, {40, 30}, {40, 79}, cv::Scalar(255));
    EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 12) != longer), 0) << gap;
  }
  // Aslant, where the pixels of the two edges would pass between one another.
  for (const int shift : {0, 1}) {
    cv::Mat edges(80, 80, CV_8UC1, cv::Scalar(0));
    cv::line(edges, {10, 10}, {69, 69}, cv::Scalar(255));
    cv::line(edges, {37 + shift, 43}, {12 + shift, 68}, cv::Scalar(255));
    const cv::Mat longer = with_longer_ends(edges, 12);
    EXPECT_EQ(longer.at<std::uint8_t>(42, 38 + shift), 255) << shift;
    for (int r = 12; r < 70; ++r)
      for (int c = r + 1; c < 68; ++c) EXPECT_EQ(longer.at<std::uint8_t>(r, c), 0) << shift << ": " << c << ", " << r;
  }
}

}  // namespace
}  // namespace veneer::planner
