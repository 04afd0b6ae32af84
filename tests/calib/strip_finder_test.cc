#include "calib/strip_finder.h"

#include <gmock/gmock.h>

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/strip_gaps.h"
#include "tests/support/drawn_strips.h"

namespace veneer {
namespace {

using drawn::DrawnBoard;
using drawn::DrawnStrip;

std::vector<calib::FoundStrip> strips_on(const calib::WorkMap& map) {
  const cv::Mat unmarked = cv::Mat::zeros(map.bgr.size(), CV_8UC1);
  return calib::find_strips(calib::view_board(map, unmarked), unmarked);
}
std::vector<calib::FoundStrip> strips_of(const DrawnBoard& board) { return strips_on(draw(board)); }

using drawn::kEbony;
using drawn::kOak;
using drawn::kSilver;

void expect_corners(const calib::FoundStrip& found, const DrawnStrip& strip) {
  const auto corners = calib::corners_of(found);
  const std::array<cv::Point2d, 4> truth = {cv::Point2d(strip.upper_left.x + strip.lean, strip.lower_right.y),
                                            cv::Point2d(strip.lower_right.x + strip.lean, strip.lower_right.y),
                                            cv::Point2d(strip.lower_right.x, strip.upper_left.y), strip.upper_left};
  for (std::size_t i = 0; i < 4; ++i) {
    const cv::Point2d off = corners[i] / drawn::kPxPerMm - truth[i];
    EXPECT_LT(std::hypot(off.x, off.y), 0.3) << "corner " << i << " " << corners[i] / drawn::kPxPerMm << truth[i];
  }
}

TEST(StripFinder, FindsStripsOfEveryColourBetweenNarrowGaps) {
  DrawnBoard board;
  board.strips = {{{12, 12}, {34, 48}, kOak, 0.1, 0.06},
                  {{35, 12}, {55, 48}, kSilver, 0.1, 0.06},
                  {{56.5, 12}, {78, 48}, kEbony, -0.1, 0.06}};
  const auto found = strips_of(board);
  ASSERT_EQ(found.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) expect_corners(found[i], board.strips[i]);
}

TEST(StripFinder, FindsStripsInTwoRows) {
  DrawnBoard board;
  board.height = 80;
  board.strips = {{{12, 12}, {40, 38}, kOak, 0, 0.06},
                  {{42, 12}, {76, 38}, kSilver, 0, 0.06},
                  {{12, 41}, {30, 68}, kSilver, 0, 0.06},
                  {{32, 41}, {76, 68}, kOak, 0, 0.06}};
  EXPECT_EQ(strips_of(board).size(), 4U);
}

// Between them no line is the end of all.
TEST(StripFinder, FindsStripsInTwoRowsThatEndRaggedly) {
  DrawnBoard board;
  board.width = 120, board.height = 90;
  const std::array<double, 7> upper = {40, 36, 38.6, 34.6, 41, 37.2, 39.4}, lower = {46, 48.6, 44, 49, 45, 47.4, 43};
  for (std::size_t i = 0; i < upper.size(); ++i) {
    const double x = 12 + 14.0 * static_cast<double>(i);
    board.strips.push_back({{x, 12}, {x + 12, upper[i]}, i % 2 == 0 ? kSilver : kEbony, 0, 0.06});
    board.strips.push_back({{x + 5, lower[i]}, {x + 15, 78}, i % 2 == 0 ? kEbony : kSilver, 0, 0.06});
  }
  EXPECT_EQ(strips_of(board).size(), board.strips.size());
}

// Where the wood of the other row looks like the board's shade, the shade along a strip and a line of that wood make a
// narrow gap through both rows: what is left of the gap would count as wood.
TEST(StripFinder, DoesNotFollowAGapIntoTheOtherRow) {
  const cv::Scalar off_white(208, 222, 228);
  DrawnBoard board;
  board.bgr = off_white, board.width = board.height = 100, board.texture = 0.004;
  board.strips = {{{12, 12}, {60, 46.5}, kSilver, 0, 0.005},
                  {{12, 53}, {34, 88}, kOak, 0, 0.06},
                  {{36.5, 51}, {88, 88}, kEbony, 0, 0.06},
                  {{62, 12}, {74, 48.5}, kOak, 0, 0.06},
                  {{76, 12}, {88, 45.5}, kEbony, 0, 0.06}};
  const std::vector<DrawnStrip> strips = board.strips;
  board.strips.push_back({{34, 12}, {34.5, 46.5}, kSilver * 0.8});
  board.strips.push_back({{34, 53}, {34.5, 88}, off_white * 0.8});
  calib::WorkMap map = draw(board);
  cv::GaussianBlur(map.bgr, map.bgr, {}, 0.8);
  const auto found = strips_on(map);
  ASSERT_EQ(found.size(), strips.size());
  for (std::size_t i = 0; i < 3; ++i) expect_corners(found[i], strips[i]);  // those beside the gap
}

TEST(StripFinder, GivesEachStripOfARowItsOwnEnd) {
  DrawnBoard board;
  board.bgr = cv::Scalar(208, 222, 228), board.width = board.height = 100, board.texture = 0.004;
  board.strips = {{{12, 12}, {60, 47}, kSilver, 0, 0.02},
                  {{12, 52}, {34, 88}, kOak, 0, 0.06},
                  {{35, 51}, {88, 88}, kEbony, 0, 0.06},
                  {{62, 12}, {88, 47.9}, kOak, 0, 0.06}};
  const auto found = strips_of(board);
  ASSERT_EQ(found.size(), board.strips.size());
  for (std::size_t i = 0; i < found.size(); ++i) expect_corners(found[i], board.strips[i]);
}

// A dark line of the grain has straight sides as well, but it does not show the board.
TEST(StripFinder, DoesNotTakeTheGrainForAGap) {
  DrawnBoard board;
  board.strips = {{{12, 12}, {78, 48}, kOak, 0, 0.05}, {{40, 12}, {41, 48}, kOak * 0.5, 0, 0.05}};
  const auto found = strips_of(board);
  ASSERT_EQ(found.size(), 1U);
  expect_corners(found[0], board.strips[0]);
}

TEST(StripFinder, SaysHowClearlyItsSidesAreSeen) {
  DrawnBoard board;
  board.texture = 0.05;
  board.strips = {{{12, 12}, {40, 48}, board.bgr * 0.4, 0, 0.03}};
  const auto clear = strips_of(board);
  ASSERT_EQ(clear.size(), 1U);
  for (const auto& side : {clear[0].left, clear[0].right, clear[0].top, clear[0].bottom}) EXPECT_GT(side.seen, 6);
}

// The widest band of board in a rectangle of the map, mm; x and y exchanged for bands that lie.
double band_within(const DrawnBoard& board, const cv::Rect2d& mm, bool lying = false) {
  const calib::WorkMap map = draw(board);
  const cv::Mat unmarked = cv::Mat::zeros(map.bgr.size(), CV_8UC1);
  const calib::BoardView view = calib::view_board(map, unmarked);
  const auto px = [](double at) { return static_cast<int>(std::lround(at * drawn::kPxPerMm)); };
  const calib::SlabRegion upright{px(mm.x), px(mm.br().x), px(mm.y), px(mm.br().y)};
  return calib::widest_board_band(
             calib::SlabView(view, unmarked, lying),
             lying ? calib::SlabRegion{upright.top, upright.bottom, upright.left, upright.right} : upright) /
         drawn::kPxPerMm;
}

TEST(BoardBand, IsNotSeenWithinAnyWood) {
  for (const cv::Scalar& wood : {kOak, kSilver, kEbony, drawn::kWenge, drawn::kWalnut, drawn::kPine}) {
    DrawnBoard board;
    board.strips = {{{12, 12}, {78, 48}, wood, 0.2, 0.06}};
    EXPECT_EQ(band_within(board, {13, 14, 64, 32}), 0) << wood;
    EXPECT_EQ(band_within(board, {14, 13, 62, 34}, true), 0) << wood;
  }
}

TEST(BoardBand, IsSeenWhereASideIsTakenTooFarOut) {
  DrawnBoard board;
  board.strips = {{{12, 12}, {78, 48}, kOak, 0, 0.06}};
  EXPECT_NEAR(band_within(board, {10.5, 14, 67, 32}), 1.5, 0.3);
  EXPECT_NEAR(band_within(board, {13, 14, 66.5, 32}), 1.5, 0.3);
  EXPECT_NEAR(band_within(board, {14, 10.5, 62, 37}, true), 1.5, 0.3);
}

TEST(BoardBand, IsSeenInAGapThatLeans) {
  DrawnBoard board;
  board.bgr = {228, 230, 230};
  const double lean = 0.3;
  // Wood in the shade's colour, and bleached wood in the board's own.
  board.strips = {{{12, 12}, {40, 48}, kSilver, lean, 0.03}, {{42, 12}, {78, 48}, {212, 224, 227}, lean, 0.01}};
  EXPECT_NEAR(band_within(board, {14, 14, 62, 32}), 2, 0.4);
}

TEST(BoardBand, IsNoneWhereThereIsNothingElse) { EXPECT_EQ(band_within({}, {12, 12, 60, 30}), 0); }

TEST(StripFinder, FindsNothingOnABareBoard) { EXPECT_TRUE(strips_of({}).empty()); }

}  // namespace
}  // namespace veneer
