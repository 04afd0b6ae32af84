#include "calib/sheet_outline.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer {
namespace {

using calib::JoinedFrame;

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

// Points of a sheet's border, a millimetre apart, turned by a degree.
constexpr double kWidth = 200, kHeight = 140, kTurned = kPi / 180;
Point<JoinedFrame> on_bed(double x, double y) {
  return point<JoinedFrame>(30 + std::cos(kTurned) * x - std::sin(kTurned) * y,
                            20 + std::sin(kTurned) * x + std::cos(kTurned) * y);
}
std::vector<Point<JoinedFrame>> border() {
  std::vector<Point<JoinedFrame>> out;
  for (int i = 0; i < kWidth; ++i) out.push_back(on_bed(i, 0)), out.push_back(on_bed(i, kHeight));
  for (int i = 0; i < kHeight; ++i) out.push_back(on_bed(0, i)), out.push_back(on_bed(kWidth, i));
  return out;
}
void expect_sheet(const std::vector<Point<JoinedFrame>>& points, const char* what) {
  const auto sheet = calib::fit_rectangle(points, 0, 1);
  EXPECT_NEAR(sheet.width.count(), kWidth, 0.05) << what;
  EXPECT_NEAR(sheet.height.count(), kHeight, 0.05) << what;
  const auto origin = sheet.panel_from_joined * on_bed(0, 0);
  EXPECT_NEAR(origin.x.count(), 0, 0.05) << what;
  EXPECT_NEAR(origin.y.count(), 0, 0.05) << what;
}

TEST(SheetOutline, IsARectangleWhateverSticksOutOfIt) {
  expect_sheet(border(), "nothing");
  for (const auto& [x, y, along, up] : {std::array{80.0, -2.5, 1.0, 0.0},
                                        {60.0, kHeight + 3.0, 1.0, 0.0},
                                        {-2.2, 50.0, 0.0, 1.0},
                                        {kWidth + 2.0, 30.0, 0.0, 1.0}}) {
    auto points = border();
    for (int i = 0; i < 4; ++i) points.push_back(on_bed(x + along * i, y + up * i));
    expect_sheet(points, "a splinter");
  }
}

// The ends of a side's points may be those of a shadow, a millimetre beyond.
TEST(SheetOutline, FollowsMostOfASidesPoints) {
  auto points = border();
  for (auto& p : points)
    if (const auto off = p.y.count() - on_bed(0, 0).y.count(); off < 4 && p.x < on_bed(60, 0).x)
      p.y -= Millimetres(1.0);
  expect_sheet(points, "a shadow at a third of the lower side");
}

// Where a tile ends within the sheet its rim is a border too.
TEST(SheetOutline, IsTheOutermostOfLinesThatAreAsLong) {
  auto points = border();
  for (int i = 0; i < kHeight; ++i) points.push_back(on_bed(150, i)), points.push_back(on_bed(40, i));
  expect_sheet(points, "rims of tiles");
}

}  // namespace
}  // namespace veneer
