#include "daemon/picture_reply.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

namespace veneer::daemon {
namespace {

std::string stored(int columns, int rows) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", cv::Mat(rows, columns, CV_8UC3, cv::Scalar(10, 90, 200)), bytes);
  return {bytes.begin(), bytes.end()};
}

cv::Mat picture_of(const ApiReply& reply) {
  return cv::imdecode(std::vector<unsigned char>(reply.body.begin(), reply.body.end()), cv::IMREAD_COLOR);
}

TEST(PictureReply, AStoredPictureIsGivenInTheWidthThatWasAskedFor) {
  const cv::Mat shown = picture_of(png_reply(stored(300, 200), 120.0));
  EXPECT_EQ(shown.cols, 120);
  EXPECT_EQ(shown.rows, 80);
}

TEST(PictureReply, AStoredPictureGoesOutAsItIsWhenItIsNotTooWide) {
  const std::string bytes = stored(300, 200);
  EXPECT_EQ(png_reply(bytes, {}).body, bytes);
  EXPECT_EQ(png_reply(bytes, 300.0).body, bytes);
  EXPECT_EQ(png_reply(bytes, 9000.0).body, bytes);
  EXPECT_EQ(png_reply(bytes, 3.0).body, bytes);
}

TEST(PictureReply, WhatIsNoPictureIsSaid) {
  EXPECT_EQ(png_reply(std::string("no picture"), 100.0).status, 500);
  EXPECT_EQ(png_reply(std::string(), 100.0).status, 500);
}

}  // namespace
}  // namespace veneer::daemon
