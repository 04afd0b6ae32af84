// What patches of any size cover of some wood, and as it is kept.
#include "daemon/stock/covered_wood.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <opencv2/imgproc.hpp>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {
namespace {

constexpr ScanResolution kFourPixels{4};  // to the millimetre

Raster<PanelFrame> speckled_wood() {
  const cv::Size size{*rc::gen::inRange(1, 90), *rc::gen::inRange(1, 90)};
  Raster<PanelFrame> out{cv::Mat(size, CV_8UC1, cv::Scalar(255)), kFourPixels};
  for (int i = 0, n = *rc::gen::inRange(0, 12); i < n; ++i) {
    const cv::Point middle{*rc::gen::inRange(0, 90), *rc::gen::inRange(0, 90)};
    cv::circle(out.pixels, middle, *rc::gen::inRange(0, 9), {0}, -1);
  }
  return out;
}

// By erosion and dilation, which OpenCV does.
SquareMillimetres opened(const Raster<PanelFrame>& free, int side) {
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  Raster<PanelFrame> out = free;
  cv::erode(free.pixels, out.pixels, square, {0, 0}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::dilate(out.pixels, out.pixels, square, {side - 1, side - 1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  return wood_area(out);
}

RC_GTEST_PROP(CoveredWood, IsWhatOpeningsLeaveForEverySide, ()) {
  const auto free = speckled_wood();
  const CoveredWood covered(free);
  const auto kept = CoveredWood::read(covered.text());
  RC_ASSERT(kept.has_value());
  for (int side = 1; side < 92; ++side) {
    const bool fits = side <= free.pixels.cols && side <= free.pixels.rows;
    const auto expected = fits ? opened(free, side) : SquareMillimetres(0);
    RC_ASSERT(covered.by(Millimetres(side / 4.0)) == expected);
    RC_ASSERT(kept->by(Millimetres(side / 4.0)) == expected);
  }
}

TEST(CoveredWood, OfNoSideIsAllOfIt) {
  const Raster<PanelFrame> free{cv::Mat(8, 12, CV_8UC1, cv::Scalar(255)), kFourPixels};
  const CoveredWood covered(free);
  EXPECT_EQ(covered.by(Millimetres(0)), SquareMillimetres(6));
  EXPECT_EQ(covered.by(Millimetres(2)), SquareMillimetres(6));
  EXPECT_EQ(covered.by(Millimetres(2.01)), SquareMillimetres(0)) << "more than its 8 pixels";
  EXPECT_EQ(covered.text(), "4 8:96");
}

TEST(CoveredWood, IsNotReadFromAnythingElse) {
  EXPECT_EQ(CoveredWood::read("4")->by(Millimetres(1)), SquareMillimetres(0)) << "of no wood";
  for (const char* other :
       {"", "x", "0", "-4 1:2", "nan 1:2", "4 8", "4 8:", "4 8:x", "4 0:96", "4 8:0", "4 -8:96", "4,8:96"})
    EXPECT_FALSE(CoveredWood::read(other)) << other;
}

}  // namespace
}  // namespace veneer::daemon
