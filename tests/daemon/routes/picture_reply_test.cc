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

}  // namespace
}  // namespace veneer::daemon
