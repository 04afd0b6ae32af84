// Edges that count, and the directions across them.
#include "planner/layout/direction_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

TEST(DirectionField, PointsAcrossTheNearestEdgeUpToQuarterTurns) {
  cv::Mat edges(200, 200, CV_8UC1, cv::Scalar(0));
  cv::line(edges, {60, 160}, {140, 80}, cv::Scalar(255));  // up to the right, at 45 degrees
  const DirectionField field = direction_field(edges, 3);
  EXPECT_NEAR(std::abs(static_cast<double>(field.angle.at<float>(110, 90))), std::atan(1.0), 0.05);
  EXPECT_NEAR(static_cast<double>(field.angle.at<float>(100, 4)), 0, 0.05) << "the border is an edge too";
  EXPECT_EQ(field.distance.at<float>(160, 60), 0.0F);
}

TEST(DirectionField, FindsTheEdgeOfADiscAndNoneInNoise) {
  cv::Mat picture(300, 300, CV_8UC3, cv::Scalar(90, 90, 90));
  cv::circle(picture, {150, 150}, 80, cv::Scalar(180, 180, 180), cv::FILLED);
  cv::Mat noise(picture.size(), CV_8UC3);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, 12);
  picture += noise;
  const cv::Mat edges = salient_edges(picture, 24);
  EXPECT_GT(cv::countNonZero(edges), 400);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c) {
      if (edges.at<std::uint8_t>(r, c) == 0) continue;
      EXPECT_NEAR(std::hypot(r - 150, c - 150), 80, 4);
    }
}

}  // namespace
}  // namespace veneer::planner
