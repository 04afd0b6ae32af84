#include "calib/wood_faults.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "tests/support/drawn_strips.h"

namespace veneer {
namespace {

using drawn::DrawnBoard;
using drawn::put_disc;
using drawn::put_knot;
using drawn::put_line;

struct Seen {
  calib::WoodFaults faults;
  cv::Mat out;  // 255 = taken out, round ones included
};

class WoodFaults : public ::testing::Test {
 protected:
  void lay(const cv::Scalar& wood, double grain) {
    board_.strips = {{{15, 10}, {75, 50}, wood, 0, grain}};
    map_ = draw(board_);
  }
  Seen look() const {
    const auto view = calib::view_board(map_, cv::Mat::zeros(map_.bgr.size(), CV_8UC1));
    Seen seen;
    seen.faults = calib::find_faults(view, place_of(board_.strips[0], map_.bgr.size()));
    seen.out = seen.faults.mask.clone();
    for (const auto& spot : seen.faults.round)
      cv::circle(seen.out, spot.centre, static_cast<int>(spot.diameter / 2), cv::Scalar(255), cv::FILLED);
    return seen;
  }
  // Share of a disc that is taken out.
  static double taken_out(const Seen& seen, const cv::Point2d& mm, double diameter) {
    cv::Mat disc = cv::Mat::zeros(seen.out.size(), CV_8UC1);
    cv::circle(disc, mm * drawn::kPxPerMm, static_cast<int>(diameter / 2 * drawn::kPxPerMm), cv::Scalar(255),
               cv::FILLED);
    return static_cast<double>(cv::countNonZero(seen.out & disc)) / cv::countNonZero(disc);
  }
  double lost(const Seen& seen) const {
    const cv::Mat wood = place_of(board_.strips[0], map_.bgr.size());
    return static_cast<double>(cv::countNonZero(seen.out & wood)) / cv::countNonZero(wood);
  }

  DrawnBoard board_;
  calib::WorkMap map_;
};

using drawn::kEbony;
using drawn::kOak;
using drawn::kSilver;
const cv::Scalar kBleached(205, 211, 214);

TEST_F(WoodFaults, FindsHolesAndHeadsOfAnyMetalInAnyWood) {
  const cv::Scalar brass(82, 152, 187), steel(163, 160, 158), hole(15, 16, 17), lid(215, 216, 217);
  for (const auto& wood : {kOak, kSilver, kEbony, kBleached}) {
    lay(wood, 0.05);
    std::vector<cv::Point2d> places;
    for (const auto& colour : {brass, steel, hole, lid}) {
      if (cv::norm(colour - wood) < 40) continue;  // a head in the wood's own colour is told by its rim, if at all
      places.emplace_back(24 + 13.0 * static_cast<double>(places.size()), 30);
      put_disc(map_, places.back(), 4, colour);
    }
    const Seen seen = look();
    for (const auto& place : places) EXPECT_GT(taken_out(seen, place, 3.8), 0.98) << wood << place;
    EXPECT_LT(lost(seen), 0.05) << wood;
  }
}

TEST_F(WoodFaults, FindsACrackButNotTheGrain) {
  lay(kOak, 0.15);
  EXPECT_LT(lost(look()), 0.005) << "bold grain is the wood's own";
  put_line(map_, {40, 10}, {42, 35}, 0.6, {17, 19, 22});
  const Seen seen = look();
  EXPECT_GT(taken_out(seen, {41, 22}, 0.5), 0.9);
  EXPECT_LT(lost(seen), 0.03);
}

// Brown dust in a crack of black wood: as light as the wood, but not as grey. It is a tenth of the strip.
TEST_F(WoodFaults, FindsACrackThatIsToldByItsHueAlone) {
  lay(kEbony, 0.05);
  put_line(map_, {22, 31}, {60, 31}, 0.8, {24, 28, 33});
  put_line(map_, {22, 20}, {60, 20}, 0.8, {24, 28, 33});
  const Seen seen = look();
  EXPECT_GT(taken_out(seen, {41, 31}, 0.7), 0.9);
  EXPECT_GT(taken_out(seen, {41, 20}, 0.7), 0.9);
  EXPECT_LT(lost(seen), 0.1);
}

TEST_F(WoodFaults, FindsAHeadOfTheWoodsOwnColourByTheSeamAroundIt) {
  lay(kSilver, 0.3);
  put_disc(map_, {45, 30}, 7.6, kSilver * 0.5);
  put_disc(map_, {45, 30}, 7, kSilver);
  const Seen seen = look();
  EXPECT_GT(taken_out(seen, {45, 30}, 7.4), 0.98);
  EXPECT_LT(lost(seen), 0.05);
}

// Dark and light lines of one pigment on a third of the strip.
TEST_F(WoodFaults, LeavesBoldFigureOfOnePigmentAlone) {
  const cv::Scalar red(24, 40, 92);
  lay(red, 0.05);
  for (int i = 0; i < 5; ++i) {
    const double x = 20 + 3.1 * i;
    const cv::Scalar dark(24 * 0.42, 40 * 0.55, 92 * 0.78);
    put_line(map_, {x, 13}, {x + 1, 46}, 0.9, dark);
  }
  EXPECT_LT(lost(look()), 0.005);
}

// The optics mix a black strip's outermost pixels with the board's.
TEST_F(WoodFaults, DoesNotTakeTheBlurOfAStripsSidesForAFault) {
  board_.width = 150, board_.height = 110, board_.bgr = {245, 245, 245};
  board_.strips = {{{12, 12}, {135, 98}, kEbony, 0.8, 0.03}};
  map_ = draw(board_);
  cv::GaussianBlur(map_.bgr, map_.bgr, {}, 0.15 * drawn::kPxPerMm);
  EXPECT_LT(lost(look()), 0.001);
}

// On the whole it is as light and as grey as the wood; along its rim the lid is shaded, on all sides.
TEST_F(WoodFaults, FindsASmallHoleThatShowsTheLidInGreyWood) {
  lay(kSilver, 0.06);
  const std::vector<std::pair<cv::Point2d, double>> holes = {{{30, 20}, 2.0}, {{45, 33}, 2.3}, {{60, 40}, 2.6}};
  const cv::Scalar lid(236, 238, 239);
  for (const auto& [at, diameter] : holes)
    for (double across = diameter; across > 0; across -= 0.1)
      put_disc(map_, at, across, lid * (0.55 + 0.35 * (diameter - across) / 2.4));
  cv::GaussianBlur(map_.bgr, map_.bgr, {}, 0.6);
  const Seen seen = look();
  for (const auto& [at, diameter] : holes) EXPECT_GT(taken_out(seen, at, diameter), 0.98) << diameter;
  EXPECT_LT(lost(seen), 0.02);
}

// A light eye of the figure has the wood's own grain in it, a light fleck is longer than wide.
TEST_F(WoodFaults, DoesNotTakeLightFigureForASmallHole) {
  lay(kSilver, 0.06);
  for (const double x : {28.0, 44.0, 60.0}) {
    const cv::Point middle(static_cast<int>(x * drawn::kPxPerMm), static_cast<int>(30 * drawn::kPxPerMm));
    const double tall = x < 40 ? 1.0 : 2.5, reach = 3 * drawn::kPxPerMm;
    for (int r = middle.y - static_cast<int>(tall * reach); r <= middle.y + static_cast<int>(tall * reach); ++r)
      for (int c = middle.x - static_cast<int>(reach); c <= middle.x + static_cast<int>(reach); ++c) {
        const double d = std::hypot((c - middle.x) / drawn::kPxPerMm, (r - middle.y) / (tall * drawn::kPxPerMm));
        const double grain = tall > 1 ? 0 : 0.12 * std::sin(4.0 * c);
        map_.bgr.at<cv::Vec3b>(r, c) *= 1 + (0.25 + grain) * std::exp(-d * d / 0.7);
      }
  }
  EXPECT_LT(lost(look()), 0.002);
}

// It is wood, however dark.
TEST_F(WoodFaults, LeavesAKnotThatFadesIntoItsWood) {
  for (const auto& wood : {kOak, kSilver}) {
    lay(wood, 0.05);
    put_knot(map_, {32, 28}, 5, 6, 0.45);
    put_knot(map_, {58, 34}, 4.6, 5, 0.5);
    EXPECT_LT(lost(look()), 0.004) << wood;
  }
}

// Of whatever hue the board is that wood and knot are told from.
TEST_F(WoodFaults, LeavesABrownKnotInGreyWoodOnAnyBoard) {
  for (const cv::Scalar& board : {cv::Scalar(126, 163, 190), cv::Scalar(44, 58, 96), cv::Scalar(190, 150, 110)}) {
    board_.bgr = board;
    lay(drawn::kSilver, 0.05);
    put_knot(map_, {45, 30}, 5, 6, {0.35, 0.42, 0.5});
    EXPECT_LT(lost(look()), 0.004) << board;
  }
}

// A dead knot in pale wood is black-brown, and grey beside its wood.
TEST_F(WoodFaults, LeavesADeadKnotInPaleWood) {
  const cv::Scalar dead(42, 46, 50);
  for (const auto& wood : {drawn::kPine, kOak}) {
    lay(wood, 0.05);
    put_knot(map_, {32, 28}, 5, 6, {dead[0] / wood[0], dead[1] / wood[1], dead[2] / wood[2]});
    put_knot(map_, {58, 34}, 4.6, 5, {dead[0] / wood[0], dead[1] / wood[1], dead[2] / wood[2]});
    EXPECT_LT(lost(look()), 0.004) << wood;
  }
}

// The scanner's black takes hue from what is dark, and a dark knot has no other hue than its wood.
TEST_F(WoodFaults, LeavesAKnotThatKeepsLittleOfTheLight) {
  for (const auto& wood : {kOak, drawn::kPadauk, drawn::kWalnut}) {
    const double left = 0.2;
    lay(wood, 0.05);
    put_knot(map_, {32, 28}, 5, 6, left);
    put_knot(map_, {58, 34}, 4.6, 5, left);
    EXPECT_LT(lost(look()), 0.004) << wood;
  }
}

// As dark as the wood's own bands, and without a knot's hue.
TEST_F(WoodFaults, FindsASunkHoleInDarkFigureOnAnyBoard) {
  for (const cv::Scalar& board : {cv::Scalar(126, 163, 190), cv::Scalar(44, 58, 96), cv::Scalar(235, 235, 235)})
    for (const auto& wood : {drawn::kWenge, drawn::kPadauk}) {
      board_.bgr = board;
      lay(wood, 0.3);
      for (int i = 0; i < 12; ++i)
        put_line(map_, {18.0 + 4.7 * i, 11}, {18.5 + 4.7 * i, 49}, 1.6, {wood[0] * 0.6, wood[1] * 0.6, wood[2] * 0.6});
      const std::vector<cv::Point2d> places = {{28, 20}, {45, 33}, {60, 41}};
      for (const auto& place : places) put_disc(map_, place, 4.2, {17, 21, 27});
      cv::GaussianBlur(map_.bgr, map_.bgr, {}, 0.6);
      const Seen seen = look();
      for (const auto& place : places) EXPECT_GT(taken_out(seen, place, 4), 0.98) << wood << " on " << board << place;
      EXPECT_LT(lost(seen), 0.05) << wood << " on " << board;
    }
}

// Drilled twice, with a worn rim: no circle runs along it, and what lies in both is darker than what lies in one, so
// that it fades inwards as a knot does. A knot has its wood's hue.
TEST_F(WoodFaults, FindsSunkHolesThatOverlapInDarkWood) {
  for (const auto& wood : {drawn::kWenge, drawn::kPadauk, drawn::kWalnut})
    for (const double apart : {2.1, 2.7, 3.3}) {
      lay(wood, 0.2);
      const cv::Point2d first(40, 28), second = first + cv::Point2d(0.1, apart);
      put_disc(map_, first, 4.4, {17, 21, 27}), put_disc(map_, second, 4.8, {17, 21, 27});
      const cv::Rect around(30 * 6, 18 * 6, 20 * 6, 24 * 6);
      cv::Mat part = map_.bgr(around).clone();
      cv::GaussianBlur(part, part, {}, 0.4 * drawn::kPxPerMm);
      part.copyTo(map_.bgr(around));
      const Seen seen = look();
      EXPECT_GT(taken_out(seen, first, 3.8), 0.98) << wood << apart;
      EXPECT_GT(taken_out(seen, second, 4.2), 0.98) << wood << apart;
      EXPECT_LT(lost(seen), 0.05) << wood << apart;
    }
}

// Nothing is seen in it, and its worn or charred rim fades as a knot's does: a knot is never that black.
TEST_F(WoodFaults, FindsABlackHoleWhoseRimFades) {
  for (const auto& wood : {kOak, kSilver})
    for (const double fades : {0.35, 0.5}) {
      lay(wood, 0.05);
      put_disc(map_, {45, 30}, 8, {8, 8, 9});
      const cv::Rect around(30 * 6, 15 * 6, 30 * 6, 30 * 6);
      cv::Mat part = map_.bgr(around).clone();
      cv::GaussianBlur(part, part, {}, fades * drawn::kPxPerMm);
      part.copyTo(map_.bgr(around));
      EXPECT_GT(taken_out(look(), {45, 30}, 7.4), 0.98) << wood << fades;
    }
}

// Not the head alone, and no wider than it is.
TEST_F(WoodFaults, TakesOutACountersinkAsFarAsItReaches) {
  lay(kOak, 0.08);
  put_disc(map_, {45, 30}, 8, kOak * 0.45);
  put_disc(map_, {45, 30}, 4.4, {105, 103, 102});
  const Seen seen = look();
  EXPECT_GT(taken_out(seen, {45, 30}, 7.8), 0.98);
  EXPECT_LT(lost(seen), 1.25 * CV_PI * 16 / (60 * 40));
}

// A crack is darker or lighter than the wood on both of its sides; a strip's blurred and shaded side is not.
TEST_F(WoodFaults, DoesNotTakeTheShadeAlongAStripsSideForACrack) {
  lay(kOak, 0.02);
  const cv::Mat strip = place_of(board_.strips[0], map_.bgr.size());
  cv::Mat from_side;
  cv::distanceTransform(strip, from_side, cv::DIST_L2, 5);
  for (int r = 0; r < strip.rows; ++r)
    for (int c = 0; c < strip.cols / 2; ++c)
      if (strip.at<std::uint8_t>(r, c) != 0 && (r / 60) % 2 == 0)
        map_.bgr.at<cv::Vec3b>(r, c) =
            map_.bgr.at<cv::Vec3b>(r, c) * (from_side.at<float>(r, c) < 1.3 * drawn::kPxPerMm ? 0.8 : 1);
  EXPECT_LT(lost(look()), 0.002);
}

TEST_F(WoodFaults, LeavesDustAlone) {
  lay(kOak, 0.05);
  for (int i = 0; i < 20; ++i) put_disc(map_, {20.0 + 2.5 * i, 15.0 + (i * 7) % 30}, 0.25, {60, 60, 60});
  EXPECT_LT(lost(look()), 0.002);
}

}  // namespace
}  // namespace veneer
