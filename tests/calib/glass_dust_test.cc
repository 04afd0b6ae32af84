#include "calib/glass_dust.h"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "tests/support/drawn_strips.h"

namespace veneer {
namespace {

using drawn::put_disc;
using drawn::put_line;

constexpr double kHairWide = 0.15;  // mm
const cv::Scalar kGrey(62, 62, 62), kWhite(215, 215, 215);

class GlassDust : public ::testing::Test {
 protected:
  void lay(const cv::Scalar& wood, double grain) {
    board_.strips = {{{15, 10}, {75, 50}, wood, 0, grain}};
    map_ = draw(board_);
  }
  // Bent by `bend` radians from its beginning to its end.
  void put_hair(cv::Point2d from, double way, double length, double bend, const cv::Scalar& grey) {
    constexpr double kStep = 0.5;
    for (double s = 0; s < length; s += kStep) {
      const cv::Point2d to = from + kStep * cv::Point2d(std::cos(way), std::sin(way));
      put_line(map_, from, to, kHairWide, grey);
      from = to, way += bend * kStep / length;
    }
  }
  calib::GlassDust look(const cv::Mat& known = {}) const {
    const cv::Mat none = cv::Mat::zeros(map_.bgr.size(), CV_8UC1);
    const cv::Mat strips = place_of(board_.strips[0], map_.bgr.size()) / 255;
    return calib::find_glass_dust(calib::view_board(map_, none), strips, known.empty() ? none : known);
  }
  static double withheld_mm2(const calib::GlassDust& dust) {
    return cv::countNonZero(dust.mask) / (drawn::kPxPerMm * drawn::kPxPerMm);
  }

  drawn::DrawnBoard board_;
  calib::WorkMap map_;
};

TEST_F(GlassDust, FindsHairsThatLieAcrossTheGrainOfAnyWood) {
  for (const auto& wood : {drawn::kOak, drawn::kSilver}) {
    for (const auto& grey : {kGrey, kWhite}) {
      lay(wood, 0.05);
      put_hair({30, 20}, 0.2, 20, 0.6, grey);
      const auto dust = look();
      ASSERT_EQ(dust.hairs.size(), 1U) << wood << grey;
      EXPECT_NEAR(dust.hairs[0].length / drawn::kPxPerMm, 20, 3);
      EXPECT_LT(withheld_mm2(dust), 20 * 1.0) << "narrowly";
      EXPECT_GT(withheld_mm2(dust), 20 * 0.3);
    }
  }
}

TEST_F(GlassDust, LeavesTheGrainAlone) {
  for (const double grain : {0.02, 0.08, 0.2}) {
    lay(drawn::kOak, grain);
    EXPECT_TRUE(look().hairs.empty()) << grain;
  }
}

TEST_F(GlassDust, TakesNoCrackAlongTheGrainForAHair) {
  lay(drawn::kOak, 0.08);
  put_line(map_, {40, 12}, {41, 40}, 0.5, {17, 19, 22});
  EXPECT_TRUE(look().hairs.empty());
}

// The wood of a plain-sawn log shows arches: sharp on their outer side, and fading into the wood on the inner one.
TEST_F(GlassDust, TakesNoPeakOfAFigureForAHair) {
  lay(drawn::kOak, 0.05);
  const double px = drawn::kPxPerMm;
  for (int r = 0; r < map_.bgr.rows; ++r)
    for (int c = 0; c < map_.bgr.cols; ++c) {
      const double x = c / px - 45, y = r / px - 25;  // mm from the arch's top; grain runs along the longer side, x
      const double inside = x - 0.12 * y * y;         // mm from its outer side
      if (std::abs(y) > 12 || inside < 0 || x > 25) continue;
      const double dark = 0.75 * std::exp(-inside / 3);
      auto& pixel = map_.bgr.at<cv::Vec3b>(r, c);
      pixel = pixel * (1 - dark);
    }
  EXPECT_TRUE(look().hairs.empty());
}

TEST_F(GlassDust, LeavesTheRimsOfWhatIsKnownAlone) {
  lay(drawn::kOak, 0.05);
  put_disc(map_, {45, 30}, 7, {17, 17, 17});
  put_disc(map_, {45, 30}, 6, {160, 160, 160});
  cv::Mat known = cv::Mat::zeros(map_.bgr.size(), CV_8UC1);
  calib::WorkMap head{1, drawn::kPxPerMm, cv::Mat::zeros(map_.bgr.size(), CV_8UC3)};
  put_disc(head, {45, 30}, 7.2, cv::Scalar::all(255));
  cv::extractChannel(head.bgr, known, 0);
  EXPECT_TRUE(look(known).hairs.empty());
}

TEST_F(GlassDust, LeavesSpecksAlone) {
  lay(drawn::kOak, 0.05);
  for (int i = 0; i < 20; ++i) put_disc(map_, {20.0 + 2.5 * i, 15.0 + (i * 7) % 30}, 0.25, kGrey);
  EXPECT_TRUE(look().hairs.empty());
}

}  // namespace
}  // namespace veneer
