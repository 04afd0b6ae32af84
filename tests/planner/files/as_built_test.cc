#include "planner/files/as_built.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// Two pieces side by side, 20 x 10 mm together; the border between them at x = 10 mm.
Plan two_pieces() {
  Plan plan;
  plan.artworks = {{"face.png", "A", Millimetres(20), Millimetres(10)}};
  for (const double x : {0.0, 10.0}) {
    Piece piece;
    piece.artwork_outline = {point<ArtworkFrame>(x, 0), point<ArtworkFrame>(x + 10, 0), point<ArtworkFrame>(x + 10, 10),
                             point<ArtworkFrame>(x, 10)};
    plan.pieces.push_back(piece);
  }
  return plan;
}

const cv::Scalar kWood(120, 160, 200);
cv::Mat plain(double px_per_mm) { return {cvRound(10 * px_per_mm), cvRound(20 * px_per_mm), CV_8UC3, kWood}; }
cv::Vec3b at(const cv::Mat& picture, double x_mm, double y_mm) {
  const double px_per_mm = picture.cols / 20.0;
  return picture.at<cv::Vec3b>(static_cast<int>(y_mm * px_per_mm), static_cast<int>(x_mm * px_per_mm));
}

TEST(AsBuilt, JointsAreOpenAsWideAsTheyAreCutAndCharFadesBesideThem) {
  AsBuilt look;
  look.clearance = Millimetres(0.4), look.char_width = Millimetres(0.6), look.char_depth = 0.5;
  const auto built = as_built(two_pieces(), 0, plain(20), look);
  ASSERT_TRUE(built.ok()) << built.error().message;
  EXPECT_EQ(at(*built, 10.05, 5), cv::Vec3b(40, 40, 40)) << "the board below";
  EXPECT_EQ(at(*built, 10.9, 5), cv::Vec3b(120, 160, 200)) << "clean wood";
  EXPECT_EQ(at(*built, 5, 5), cv::Vec3b(120, 160, 200));
  int before = 0;
  for (const double x : {10.22, 10.32, 10.42, 10.52, 10.62, 10.72}) {
    const int red = at(*built, x, 5)[2];
    EXPECT_GT(red, before) << x;
    EXPECT_LT(red, 200) << x;
    before = red;
  }
  EXPECT_EQ(at(*built, 0.02, 5), cv::Vec3b(40, 40, 40)) << "half a joint towards what the picture lies in";
  look.putty = cv::Vec3b(10, 200, 30);
  EXPECT_EQ(at(*as_built(two_pieces(), 0, plain(20), look), 10.05, 5), cv::Vec3b(10, 200, 30));
}

TEST(AsBuilt, DarkensAsMuchAtAnyResolution) {
  // The joint and its char take the same light, whether pixels are far smaller or far larger than they are.
  const auto light_lost = [](double px_per_mm) {
    const auto built = as_built(two_pieces(), 0, plain(px_per_mm), {});
    return kWood[2] - cv::mean(*built)[2];
  };
  const double fine = light_lost(40);
  EXPECT_GT(fine, 0.5);
  for (const double coarse : {11.8, 6.0, 3.0}) EXPECT_NEAR(light_lost(coarse), fine, 0.1 * fine) << coarse;
}

TEST(AsBuilt, FromAfarJointsAreNotSeen) {
  AsBuilt look;
  const cv::Mat near = *as_built(two_pieces(), 0, plain(11.8), look);
  look.distance = Millimetres(3000);
  const cv::Mat far = *as_built(two_pieces(), 0, plain(11.8), look);
  const auto contrast = [](const cv::Mat& picture) { return at(picture, 8, 5)[2] - at(picture, 10.0, 5)[2]; };
  EXPECT_GT(contrast(near), 30);
  EXPECT_LT(contrast(far), contrast(near) / 3);
}

TEST(AsBuilt, WhatIsNoColourOrNoSizeIsRefusedInWords) {
  EXPECT_EQ(*colour_of("d8c8a0"), cv::Vec3b(0xa0, 0xc8, 0xd8));
  for (const char* text : {"", "d8c8a", "d8c8a0f", "#d8c8a0", "-8c8a0", "wood"})
    EXPECT_THAT(colour_of(text).error().message, HasSubstr("write six digits")) << text;
  AsBuilt look;
  look.clearance = Millimetres(-1);
  EXPECT_FALSE(as_built(two_pieces(), 0, plain(3), look).ok());
  EXPECT_FALSE(as_built(two_pieces(), 1, plain(3), {}).ok());
  EXPECT_FALSE(as_built(two_pieces(), 0, {}, {}).ok());
}

}  // namespace
}  // namespace veneer::planner
