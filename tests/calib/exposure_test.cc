#include "calib/exposure.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace veneer {
namespace {

TEST(Exposure, CountsWhatIsAtAnEndOfItsRangeAndIsWood) {
  cv::Mat map(10, 10, CV_8UC3, cv::Scalar(120, 150, 190)), usable(10, 10, CV_8UC1, cv::Scalar(255));
  const auto measured = [&] { return calib::measure_exposure(map, usable); };
  EXPECT_EQ(measured().blown, 0);
  EXPECT_EQ(measured().sunk, 0);
  map.rowRange(0, 2) = cv::Scalar(180, 220, 255);  // one channel is enough
  map.rowRange(2, 3) = cv::Scalar(0, 1, 2);
  map.rowRange(3, 4) = cv::Scalar(0, 1, 30);  // dark red is a colour
  EXPECT_DOUBLE_EQ(measured().blown, 0.2);
  EXPECT_DOUBLE_EQ(measured().sunk, 0.1);
  usable.rowRange(0, 1) = cv::Scalar(0);
  EXPECT_DOUBLE_EQ(measured().blown, 10.0 / 90);
  usable = cv::Scalar(0);
  EXPECT_EQ(measured().blown, 0);
}

}  // namespace
}  // namespace veneer
