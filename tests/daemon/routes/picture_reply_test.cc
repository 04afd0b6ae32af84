#include "daemon/routes/picture_reply.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

namespace veneer::daemon {
namespace {

TEST(PictureReply, APictureGoesOutUnchangedAsPng) {
  cv::Mat picture(20, 30, CV_8UC3);
  cv::randu(picture, 0, 255);
  const ApiReply reply = png_reply(picture);
  EXPECT_EQ(reply.content_type, "image/png");
  const cv::Mat back = cv::imdecode(std::vector<unsigned char>(reply.body.begin(), reply.body.end()), cv::IMREAD_COLOR);
  EXPECT_EQ(cv::norm(back, picture, cv::NORM_INF), 0);
}

TEST(PictureReply, ALineOfOnePixelOverWoodKeepsItsColourInAJpeg) {
  cv::Mat picture(64, 64, CV_8UC3, cv::Scalar(60, 90, 120));
  const cv::Vec3b blue(178, 114, 0);
  picture.col(31) = cv::Scalar(blue);
  const auto off_by = [&](planner::JpegColours colours) {
    const auto back = planner::decode_jpeg(picture_reply(picture, PictureFile::kJpeg, colours).body);
    return back ? cv::norm(back->at<cv::Vec3b>(20, 31), blue, cv::NORM_INF) : 255;
  };
  EXPECT_LT(off_by(planner::JpegColours::kOfEachPixel), 25);
  EXPECT_GT(off_by(planner::JpegColours::kOfFourPixels), 25) << "what it is for";
}

}  // namespace
}  // namespace veneer::daemon
