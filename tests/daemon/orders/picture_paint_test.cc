// What is painted over a picture: which edges count, and what matters.
#include "daemon/orders/picture_paint.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

TEST(EdgeMask, IsReadRowByRow) {
  const auto mask = edge_mask("large_edges", "5x2:ff8");
  ASSERT_TRUE(mask.ok()) << mask.error().message;
  EXPECT_EQ(mask->size(), cv::Size(5, 2));
  EXPECT_EQ(cv::countNonZero(*mask), 9);
  EXPECT_EQ(mask->at<unsigned char>(1, 3), 255);
  EXPECT_EQ(mask->at<unsigned char>(1, 4), 0);
  EXPECT_EQ(cv::countNonZero(*edge_mask("fine_edges", "64x1:00000000000000f1")), 5);
}

TEST(EdgeMask, OfAllEdgesIsEmpty) { EXPECT_TRUE(edge_mask("large_edges", "all")->empty()); }

TEST(EdgeMask, WhatIsNoneIsRefusedByName) {
  for (const char* text : {"", "x", "none", "4x4:fff", "4x4:fffff", "4x4:fffg", "4x4:FFFF", "0x4:",
                           "65x1:00000000000000000", "4x:f", "x4:f", "4:f", "4x-4:f", "4x1", "4x1:", ":", "1e1x4:f"}) {
    const auto mask = edge_mask("fine_edges", text);
    ASSERT_FALSE(mask.ok()) << text;
    EXPECT_EQ(mask.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(mask.error().message, HasSubstr("fine_edges must be all"));
  }
}

TEST(ImportanceMask, HasADigitForEachCell) {
  const auto mask = importance_mask("importance", "3x2:08f123");
  ASSERT_TRUE(mask.ok()) << mask.error().message;
  ASSERT_EQ(mask->size(), cv::Size(3, 2));
  EXPECT_EQ(mask->at<unsigned char>(0, 0), 0);
  EXPECT_EQ(mask->at<unsigned char>(0, 1), 136);
  EXPECT_EQ(mask->at<unsigned char>(0, 2), 255);
  EXPECT_EQ(mask->at<unsigned char>(1, 2), 51);
  EXPECT_TRUE(importance_mask("importance", "even")->empty());
  EXPECT_TRUE(importance_mask("importance", "48x48:" + std::string(48 * 48, '8')).ok());
}

TEST(ImportanceMask, WhatIsNoneIsRefusedByName) {
  for (const std::string& text : {std::string("all"), std::string("2x2:fff"), std::string("2x2:fffff"),
                                  std::string("2x2:fffg"), "49x1:" + std::string(49, 'f')}) {
    const auto mask = importance_mask("importance", text);
    ASSERT_FALSE(mask.ok()) << text;
    EXPECT_THAT(mask.error().message, HasSubstr("importance must be even"));
  }
}

}  // namespace
}  // namespace veneer::daemon
