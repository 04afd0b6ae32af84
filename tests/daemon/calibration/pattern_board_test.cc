// Where the pattern may be burnt: into a board that was measured, or that somebody has looked at.
#include "daemon/calibration/pattern_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

const Box<MachineFrame> kTravel{{Millimetres(0), Millimetres(0)}, {Millimetres(520), Millimetres(380)}};
const Affine2<MachineFrame, BedFrame> kKnown;
constexpr std::nullopt_t kUnknown = std::nullopt;

PatternBoard told(double width, double height) { return {Millimetres(2), Millimetres(width), Millimetres(height)}; }

calib::FoundBoard seen(double width, double height, double x = 260, double y = 190, double turn = 0) {
  return {point<BedFrame>(x, y), Millimetres(width), Millimetres(height), turn};
}

std::string refusal(const PatternBoard& board, const std::vector<calib::FoundBoard>& found,
                    const std::optional<Affine2<MachineFrame, BedFrame>>& frame) {
  const Status may = require_board(board, found, kTravel, frame);
  return may ? "" : may.error().message;
}

TEST(PatternBoard, IsMeasuredWhereTheMachinesAxesAreKnown) {
  const PatternBoard board = told(400, 300);
  EXPECT_EQ(refusal(board, {seen(402, 298, 271, 200, -3.9)}, kKnown), "");
  EXPECT_THAT(refusal(board, {seen(400, 300, 410, 190)}, kKnown),
              HasSubstr("lies 150 mm too far to the right and 0 mm"));
  EXPECT_THAT(refusal(board, {seen(400, 300, 255, 169)}, kKnown),
              HasSubstr("5 mm too far to the left and 21 mm too far to the front"));
  EXPECT_THAT(refusal(board, {seen(400, 300, 260, 190, 4.5)}, kKnown), HasSubstr("turned by 4.5 degrees"));
  EXPECT_THAT(refusal(board, {seen(300, 400)}, kKnown), HasSubstr("lies the other way, 300 x 400 mm"));
  EXPECT_EQ(refusal(board, {seen(300, 400), seen(400, 300)}, kKnown), "") << "one of two lies well";
  // Of the axes' own scale and skew.
  const Affine2<MachineFrame, BedFrame> aside(Eigen::Matrix2d::Identity(), Eigen::Vector2d(0, 30));
  EXPECT_THAT(refusal(board, {seen(400, 300)}, aside), HasSubstr("30 mm too far to the back"));
  EXPECT_EQ(refusal(board, {seen(400, 300, 260, 160)}, aside), "");
  // What was measured stands, whatever somebody says.
  const PatternBoard sure = with_confirmed(board, {kBoardOnTheBed, kBoardNotSeen});
  EXPECT_THAT(refusal(sure, {seen(400, 300, 410, 190)}, kKnown), HasSubstr("150 mm too far to the right"));
}

TEST(PatternBoard, IsLookedForByAPersonWhereThePlaceIsNotKnownYet) {
  const PatternBoard board = told(400, 300);
  EXPECT_THAT(refusal(board, {seen(400, 300)}, kUnknown), HasSubstr("--confirm \"board on the bed\""));
  EXPECT_EQ(refusal(with_confirmed(board, {kBoardOnTheBed}), {seen(300, 400, 90, 80, 30)}, kUnknown), "")
      << "the frame of the first grid sheet says nothing of the machine's";
}

TEST(PatternBoard, ThatIsNotSeenIsBurntOnlyForWhoSaysThatTheCameraDoesNotTellIt) {
  const PatternBoard board = told(400, 300);
  for (const auto& frame : {std::optional<Affine2<MachineFrame, BedFrame>>(), std::make_optional(kKnown)}) {
    EXPECT_THAT(refusal(board, {}, frame), HasSubstr("no board of 400 x 300 mm is seen"));
    EXPECT_THAT(refusal(with_confirmed(board, {kBoardOnTheBed}), {}, frame),
                HasSubstr("--confirm \"board on the bed\" --confirm \"board not seen\""))
        << "an empty bed is seen as one, and the word alone is soon said";
    EXPECT_THAT(refusal(with_confirmed(board, {kBoardNotSeen}), {}, frame), HasSubstr("no board of"));
    EXPECT_EQ(refusal(with_confirmed(board, {kBoardOnTheBed, kBoardNotSeen}), {}, frame), "");
  }
}

// One word alone burnt an empty bed.
TEST(PatternBoard, OfNoToldSizeIsNotLookedForAndNotBurnt) {
  const PatternBoard unsaid{Millimetres(2), {}, {}};
  PatternBoard one_side = unsaid;
  one_side.width = Millimetres(300);
  for (const PatternBoard& board : {unsaid, one_side}) {
    const PatternBoard sure = with_confirmed(board, {kBoardOnTheBed, kBoardNotSeen});
    EXPECT_THAT(refusal(sure, {}, kKnown), HasSubstr("the size of the board is needed"));
    EXPECT_THAT(refusal(sure, {seen(490, 350)}, kUnknown), HasSubstr("--board-height-mm"));
    EXPECT_EQ(require_size(sure).error().code, ErrorCode::kInvalidArgument);
  }
}

// A bright tray is the likeliest rectangle in every picture of a bed.
TEST(PatternBoard, OfTheBedsOwnSizeIsProvenByNoPicture) {
  const PatternBoard large = told(520, 380);
  for (const auto& frame : {std::optional<Affine2<MachineFrame, BedFrame>>(), std::make_optional(kKnown)}) {
    EXPECT_THAT(refusal(large, {seen(518, 379)}, frame), HasSubstr("cannot be told from the bed"));
    EXPECT_THAT(refusal(with_confirmed(large, {kBoardOnTheBed}), {seen(518, 379)}, frame),
                HasSubstr("--confirm \"board on the bed\" --confirm \"board not seen\""))
        << "the tray of an empty bed is seen as one";
    EXPECT_EQ(refusal(with_confirmed(large, {kBoardOnTheBed, kBoardNotSeen}), {seen(518, 379)}, frame), "");
  }
  EXPECT_THAT(refusal(with_confirmed(told(380, 520), {kBoardOnTheBed}), {seen(518, 379)}, kUnknown),
              HasSubstr("cannot be told from the bed"))
      << "told the other way round";
  for (const auto& frame : {std::optional<Affine2<MachineFrame, BedFrame>>(), std::make_optional(kKnown)})
    EXPECT_THAT(refusal(with_confirmed(told(504, 364), {kBoardOnTheBed}), {seen(509, 369)}, frame),
                HasSubstr("cannot be told from the bed"))
        << "told a little smaller than what is seen";
}

}  // namespace
}  // namespace veneer::daemon
