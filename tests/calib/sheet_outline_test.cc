#include "calib/sheet_outline.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer {
namespace {

constexpr double kPxPerMm = 6, kLeft = 10, kTop = 10, kRight = 90, kBottom = 70;  // mm

// A sheet on the scanner's lid, with the shadow that the lid has around it: `depth` at the sheet, gone within `reach`.
cv::Mat sheet_on_lid(const cv::Scalar& board, double depth, double reach) {
  cv::Mat picture(480, 600, CV_8UC3);
  for (int r = 0; r < picture.rows; ++r)
    for (int c = 0; c < picture.cols; ++c) {
      const double x = (c + 0.5) / kPxPerMm, y = (r + 0.5) / kPxPerMm;
      const double off = std::hypot(std::max({kLeft - x, 0.0, x - kRight}), std::max({kTop - y, 0.0, y - kBottom}));
      const double light = 1 - depth * std::max(0.0, 1 - off / reach);
      for (int k = 0; k < 3; ++k)
        picture.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(off > 0 ? 236 * light : board[k]);
    }
  cv::GaussianBlur(picture, picture, {}, 0.6);
  return picture;
}

// Of the border's points nearest to each side the mean distance to it at worst, outwards, mm.
double worst_side(const cv::Mat& picture) {
  const auto outline = calib::find_outline(picture, {kPxPerMm}, {});
  std::array<double, 4> sum{}, count{};
  for (const auto& p : outline) {
    const double x = p.x.count() / kPxPerMm, y = p.y.count() / kPxPerMm;
    const std::array<double, 4> off = {kLeft - x, x - kRight, kTop - y, y - kBottom};
    const auto side = static_cast<std::size_t>(std::max_element(off.begin(), off.end()) - off.begin());
    sum[side] += off[side], count[side] += 1;
  }
  double worst = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(count[i], 50) << "side " << i;
    worst = std::max(worst, std::abs(sum[i] / std::max(1.0, count[i])));
  }
  return worst;
}

TEST(SheetOutline, EndsAtTheSheetAndNotAtItsShadowOnTheLid) {
  EXPECT_LT(worst_side(sheet_on_lid({126, 163, 190}, 0, 1)), 0.05);
  EXPECT_LT(worst_side(sheet_on_lid({126, 163, 190}, 0.35, 2.5)), 0.1) << "beige, wide shadow";
  EXPECT_LT(worst_side(sheet_on_lid({203, 217, 223}, 0.3, 1)), 0.1) << "off-white, narrow shadow";
}

}  // namespace
}  // namespace veneer
