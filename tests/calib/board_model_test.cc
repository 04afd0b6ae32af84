#include "calib/board_model.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "tests/support/drawn_strips.h"

namespace veneer {
namespace {

using drawn::DrawnBoard;

// A strip in the middle of the board.
DrawnBoard one_strip(const cv::Scalar& board, const cv::Scalar& wood) {
  DrawnBoard drawn;
  drawn.bgr = board;
  drawn.strips = {{{30, 12}, {60, 48}, wood, 0, 0.05}};
  return drawn;
}

calib::BoardView view_of(const calib::WorkMap& map) {
  return calib::view_board(map, cv::Mat::zeros(map.bgr.size(), CV_8UC1));
}

// The mean of the square millimetres' unlikeness within a rectangle (mm).
double unlike_in(const calib::BoardView& view, const cv::Rect& mm) { return cv::mean(view.unlike(mm))[0]; }

TEST(BoardModel, TellsStripFromBoardWhateverTheirColours) {
  const cv::Scalar beige(126, 163, 190), white(238, 240, 240), black(33, 31, 31), grey(131, 129, 128);
  const cv::Scalar silver(149, 150, 150), bleached(205, 211, 214), ebony(28, 29, 31), oak(110, 150, 190);
  const std::vector<std::pair<cv::Scalar, cv::Scalar>> pairs = {{beige, oak}, {beige, silver}, {white, bleached},
                                                                {black, oak}, {grey, silver},  {beige, ebony}};
  for (const auto& [board, wood] : pairs) {
    const calib::BoardView view = view_of(draw(one_strip(board, wood)));
    EXPECT_GT(view.rim_share, 0.95) << board << wood;
    EXPECT_LT(unlike_in(view, {5, 14, 20, 30}), 3) << board << wood;
    EXPECT_GT(unlike_in(view, {33, 15, 24, 30}), 8) << board << wood;
  }
}

TEST(BoardModel, EvensOutTheLight) {
  DrawnBoard drawn = one_strip({126, 163, 190}, {149, 150, 150});
  drawn.falloff = 0.2;
  const calib::BoardView view = view_of(draw(drawn));
  EXPECT_NEAR(cv::mean(view.planes[0](cv::Rect(12, 12, 60, 60)))[0], 0, 0.01) << "a corner";
  EXPECT_NEAR(cv::mean(view.planes[0](cv::Rect(120, 120, 48, 120)))[0], 0, 0.01) << "beside the strip";
}

TEST(BoardModel, SaysHowMuchOfTheRimIsOneMaterial) {
  DrawnBoard drawn = one_strip({126, 163, 190}, {149, 150, 150});
  drawn.strips.push_back({{0, 0}, {36, 60}, {60, 60, 60}, 0, 0});  // something lies over two fifths of it
  EXPECT_LT(view_of(draw(drawn)).rim_share, 0.7);
}

}  // namespace
}  // namespace veneer
