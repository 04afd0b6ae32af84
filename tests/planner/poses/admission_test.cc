#include "planner/poses/admission.h"

#include <gtest/gtest.h>

namespace veneer::planner {
namespace {

// Wood of 100 x 20 mm.
std::vector<MatchPanel> board() {
  Raster<PanelFrame> free;
  free.pixels = cv::Mat(20, 100, CV_8UC1, cv::Scalar(255));
  free.resolution = ScanResolution{1};
  return {{free, FreeWood(free, Millimetres(0.1), Millimetres(0))}};
}

// A square of 8 mm whose left side lies there.
PlacedOutline square_at(double x) {
  const auto corner = [](double at, double up) { return point<PanelFrame>(at, up); };
  return {0, {corner(x, 5), corner(x + 8, 5), corner(x + 8, 13), corner(x, 13)}};
}

TEST(Admission, LetsAllMoveThatHaveRoom) {
  const PlacedOutlines before{square_at(10), square_at(30), {}}, wished{square_at(30), square_at(10), square_at(50)};
  EXPECT_EQ(*admitted(wished, before, board()), (std::vector<bool>{true, true, true}));
}

TEST(Admission, WhoStaysWhereItIsDoesNotMove) {
  const PlacedOutlines before{square_at(10), {}};
  EXPECT_EQ(*admitted(before, before, board()), (std::vector<bool>{false, false}));
}

TEST(Admission, PutsBackWhomTheWoodRefusesAndLetsTheOthersMove) {
  const PlacedOutlines before{square_at(10), square_at(30)}, wished{square_at(96), square_at(50)};
  EXPECT_EQ(*admitted(wished, before, board()), (std::vector<bool>{false, true}));
}

TEST(Admission, PutsBackWhoeverTookThePlaceOfOneThatIsPutBack) {
  // The last is refused, so that the one before it cannot have its place, and so on.
  const PlacedOutlines before{square_at(10), square_at(30), square_at(50), square_at(70)},
      wished{square_at(30), square_at(50), square_at(96), square_at(80)};
  EXPECT_EQ(*admitted(wished, before, board()), (std::vector<bool>{false, false, false, true}));
}

TEST(Admission, OfTwoThatWishForTheSameWoodGivesItToTheFirst) {
  const PlacedOutlines before{square_at(10), square_at(30), {}}, wished{square_at(50), square_at(55), square_at(45)};
  EXPECT_EQ(*admitted(wished, before, board()), (std::vector<bool>{true, false, false}));
}

TEST(Admission, HasNoAnswerOnceAStopIsRequested) {
  std::stop_source stop;
  stop.request_stop();
  const PlacedOutlines before{square_at(10), square_at(30)}, wished{square_at(30), square_at(10)};
  const auto moves = admitted(wished, before, board(), stop.get_token());
  ASSERT_FALSE(moves.ok());
  EXPECT_EQ(moves.error().code, ErrorCode::kCancelled);
}

TEST(Admission, KeepsTheKerfBetweenWhoStaysAndWhoMoves) {
  const PlacedOutlines before{square_at(10), square_at(30)};
  EXPECT_EQ(*admitted({square_at(10), square_at(18.1)}, before, board()), (std::vector<bool>{false, false}));
  EXPECT_EQ(*admitted({square_at(10), square_at(18.3)}, before, board()), (std::vector<bool>{false, true}));
}

}  // namespace
}  // namespace veneer::planner
