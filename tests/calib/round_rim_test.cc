#include "calib/round_rim.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/drawn_strips.h"

namespace veneer {
namespace {

using drawn::kEbony;
using drawn::kOak;
using drawn::kPadauk;
using drawn::kSilver;
using drawn::kWalnut;
using drawn::kWenge;
using drawn::put_disc;
using drawn::put_knot;

const cv::Scalar kHole(15, 16, 17), kBrass(82, 152, 187), kSteel(163, 160, 158);

class RoundRim : public ::testing::Test {
 protected:
  void lay(const cv::Scalar& wood, double grain) {
    board_.strips = {{{15, 10}, {75, 50}, wood, 0, grain}};
    map_ = draw(board_);
  }
  // As scanned: blurred by the optics and the pixel.
  calib::RoundRim look(const cv::Point2d& at, double diameter) const {
    calib::WorkMap seen = map_;
    cv::GaussianBlur(map_.bgr, seen.bgr, {}, 0.12 * drawn::kPxPerMm);
    const auto view = calib::view_board(seen, cv::Mat::zeros(seen.bgr.size(), CV_8UC1));
    const cv::Mat strip = place_of(board_.strips[0], seen.bgr.size());
    const calib::RimScale scale(view, strip, cv::boundingRect(strip));
    return find_rim(view, scale, {at * drawn::kPxPerMm, diameter * drawn::kPxPerMm});
  }
  bool is_grey(const cv::Point2d& at, double diameter) const {
    const auto view = calib::view_board(map_, cv::Mat::zeros(map_.bgr.size(), CV_8UC1));
    return is_grey_in_dark_wood(view, place_of(board_.strips[0], map_.bgr.size()),
                                {at * drawn::kPxPerMm, diameter * drawn::kPxPerMm});
  }
  static void expect_circle(const calib::RoundRim& rim, const cv::Point2d& centre, double diameter,
                            const std::string& what) {
    EXPECT_LT(cv::norm(rim.circle.centre / drawn::kPxPerMm - centre), 0.25) << what;
    EXPECT_NEAR(rim.circle.diameter / drawn::kPxPerMm, diameter, 0.5) << what;
  }

  drawn::DrawnBoard board_;
  calib::WorkMap map_;
};

// The place is off by a millimetre, and the size by a third.
TEST_F(RoundRim, IsTheCircleThatAHoleOrAHeadEndsAt) {
  for (const auto& wood : {kOak, kSilver, kEbony}) {
    lay(wood, 0.08);
    double x = 24;
    std::vector<std::pair<cv::Point2d, double>> placed;
    for (const auto& [colour, diameter] : {std::pair(kBrass, 6.0), std::pair(kSteel, 5.0), std::pair(kHole, 3.0)}) {
      if (cv::norm(colour - wood) < 25) continue;
      placed.emplace_back(cv::Point2d(x, 30), diameter);
      put_disc(map_, placed.back().first, diameter, colour);
      x += 14;
    }
    for (const auto& [centre, diameter] : placed) {
      const calib::RoundRim rim = look(centre + cv::Point2d(0.6, -0.8), 0.7 * diameter);
      EXPECT_GT(rim.step, 2.5) << wood << diameter;
      expect_circle(rim, centre, diameter, "wood " + std::to_string(wood[0]));
    }
  }
}

// A head in its countersink, of which one side is lit as bright as the wood.
TEST_F(RoundRim, IsTheCountersinksAndNotTheHeads) {
  lay(kOak, 0.08);
  put_disc(map_, {45, 30}, 8, kOak * 0.45);
  cv::ellipse(map_.bgr, cv::Point(270, 180), {24, 24}, 0, -45, 45, kOak * 0.95, cv::FILLED);
  put_disc(map_, {45, 30}, 4.4, kSteel * 0.65);
  expect_circle(look({45, 30}, 5), {45, 30}, 8, "countersink");
}

TEST_F(RoundRim, IsMissedInTheFigureOfTheWood) {
  lay(kOak, 0.15);
  for (int i = 0; i < 12; ++i) EXPECT_LT(look({20.0 + 4 * i, 16.0 + (i * 7) % 28}, 3 + 0.3 * i).step, 1.6) << i;
}

TEST_F(RoundRim, IsSoftWhereAKnotFadesAndSharpWhereAHoleEnds) {
  for (const auto& wood : {kOak, kSilver})
    for (const double size : {4.5, 6.0}) {
      lay(wood, 0.05);
      put_knot(map_, {30, 30}, 0.85 * size, size, 0.45);
      put_disc(map_, {58, 30}, 0.85 * size, wood * 0.45);
      const calib::RoundRim knot = look({30, 30}, size), hole = look({58, 30}, size);
      EXPECT_TRUE(knot.dark && knot.soft) << wood << size;
      EXPECT_TRUE(!hole.dark && !hole.soft) << "evenly black, so not darkest in its middle: " << wood << size;
    }
}

// Boards of a workshop: primed, brown, blue, white. What the eyes see is told from them.
const cv::Scalar kBoards[] = {{126, 163, 190}, {44, 58, 96}, {190, 150, 110}, {235, 235, 235}};
const cv::Scalar kSunkHole(17, 21, 27);

// Told by the wood's own hue, whatever hue the board has. Brown in grey wood is none.
TEST_F(RoundRim, IsGreyWhereAHoleEndsTheHueOfTheWood) {
  for (const auto& board : kBoards)
    for (const auto& wood : {kWenge, kPadauk}) {
      board_.bgr = board;
      lay(wood, 0.1);
      put_disc(map_, {30, 30}, 4.5, kSunkHole);
      put_knot(map_, {58, 30}, 4.5, 5, 0.45);
      EXPECT_TRUE(is_grey({30, 30}, 4.5)) << "a hole in " << wood << " on " << board;
      EXPECT_FALSE(is_grey({58, 30}, 4.5)) << "a knot in " << wood << " on " << board;
    }
}

// What the scanner's black adds takes hue from what is dark: a knot keeps as much as its wood would.
TEST_F(RoundRim, IsNotGreyAroundAKnotThatKeepsLittleOfTheLight) {
  for (const auto& wood : {kWenge, kPadauk, kWalnut, kOak})
    for (const double left : {0.6, 0.4, 0.2, 0.15}) {
      lay(wood, 0.1);
      put_knot(map_, {45, 30}, 5, 5, left);
      EXPECT_FALSE(is_grey({45, 30}, 4)) << wood << left;
    }
}

TEST_F(RoundRim, IsGreyOnlyWhereItIsDarkerThanDarkWood) {
  lay(kOak, 0.1);
  put_disc(map_, {45, 30}, 4.5, kSunkHole);
  EXPECT_FALSE(is_grey({45, 30}, 4.5)) << "what is dark in pale wood is told by its rim";
  lay(kWalnut, 0.1);
  put_disc(map_, {30, 30}, 4.5, kSunkHole);
  put_disc(map_, {58, 30}, 4.5, {86, 99, 122});
  EXPECT_TRUE(is_grey({30, 30}, 4.5));
  EXPECT_FALSE(is_grey({58, 30}, 4.5)) << "a paler fleck";
}

// What lies beside the strip says nothing of its wood.
TEST_F(RoundRim, IsToldFromTheStripsOwnWood) {
  board_.bgr = {40, 90, 200};
  lay(kSilver * 0.4, 0.05);
  put_disc(map_, {45, 12}, 3, kSunkHole);
  EXPECT_FALSE(is_grey({45, 12}, 3)) << "an orange board beside grey wood";
  lay(kWenge, 0.05);
  put_disc(map_, {15.5, 10.5}, 3, kSunkHole);
  EXPECT_FALSE(is_grey({15.5, 10.5}, 3)) << "too little of the wood is there";
  EXPECT_FALSE(is_grey({5, 5}, 3)) << "beside the strip";
}

// A foreign patch may be wider than any rim that is looked for.
TEST(RoundRimOfNothing, IsNone) {
  constexpr double kPx = 6;
  calib::BoardView view;
  view.px_per_mm = kPx;
  view.planes = {cv::Mat(600, 600, CV_32FC1, cv::Scalar(-2.5)), cv::Mat::zeros(600, 600, CV_32FC1),
                 cv::Mat::zeros(600, 600, CV_32FC1)};
  const cv::Mat strip(600, 600, CV_8UC1, cv::Scalar(255));
  const calib::RimScale scale(view, strip, cv::Rect(0, 0, 600, 600));
  for (const double diameter : {4.0, 11.0, 14.0, 19.8}) {
    const calib::RoundRim rim = find_rim(view, scale, {{300, 300}, diameter * kPx});
    EXPECT_EQ(rim.step, 0) << diameter;
    EXPECT_FALSE(rim.dark || rim.soft) << diameter;
  }
}

}  // namespace
}  // namespace veneer
