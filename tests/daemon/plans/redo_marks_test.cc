// Which pieces of a job are made again.
#include "daemon/plans/redo_marks.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using State = db::PieceState;

constexpr JobId kJob{7};

std::vector<db::PieceRecord> pieces(const std::vector<std::pair<const char*, State>>& of) {
  std::vector<db::PieceRecord> out;
  for (const auto& [mark, state] : of) {
    db::PieceRecord& piece = out.emplace_back();
    piece.job = kJob;
    piece.mark = mark;
    piece.state = state;
  }
  return out;
}
const auto kSixPieces = pieces({{"A1", State::kCut},
                                {"A2", State::kScrap},
                                {"A3", State::kReleased},
                                {"A4", State::kUnfilled},
                                {"A5", State::kReserved},
                                {"A6", State::kCut}});

TEST(RedoMarks, AreAllThatAreMissingUnlessSomeAreNamed) {
  const auto all = marks_to_redo(kSixPieces, kJob, {}, false);
  ASSERT_TRUE(all.ok());
  EXPECT_THAT(*all, ElementsAre("A2", "A3", "A4"));
  const auto named = marks_to_redo(kSixPieces, kJob, {"A4", "A2"}, false);
  ASSERT_TRUE(named.ok());
  EXPECT_THAT(*named, ElementsAre("A2", "A4")) << "in the order of the job";
}

TEST(RedoMarks, WhatIsCutIsMadeAgainOnlyWhereItIsSaidToBeLost) {
  const auto good = marks_to_redo(kSixPieces, kJob, {"A1"}, false);
  ASSERT_FALSE(good.ok());
  EXPECT_EQ(good.error().code, ErrorCode::kConflict);
  EXPECT_THAT(good.error().message, HasSubstr("veneerctl job redo 7 A1 --lost"));
  const auto lost = marks_to_redo(kSixPieces, kJob, {"A1"}, true);
  ASSERT_TRUE(lost.ok());
  EXPECT_THAT(*lost, ElementsAre("A1"));
  const auto unnamed = marks_to_redo(kSixPieces, kJob, {}, true);
  ASSERT_TRUE(unnamed.ok());
  EXPECT_THAT(*unnamed, ElementsAre("A2", "A3", "A4")) << "nobody named one that is cut";
}

TEST(RedoMarks, WhatHasItsWoodOrIsInDoubtIsNot) {
  const auto reserved = marks_to_redo(kSixPieces, kJob, {"A5"}, true);
  ASSERT_FALSE(reserved.ok());
  EXPECT_EQ(reserved.error().code, ErrorCode::kConflict);
  EXPECT_THAT(reserved.error().message, HasSubstr("still to be cut"));
  const auto doubtful = marks_to_redo(pieces({{"A1", State::kSuspect}}), kJob, {"A1"}, true);
  ASSERT_FALSE(doubtful.ok());
  EXPECT_EQ(doubtful.error().code, ErrorCode::kConflict);
  EXPECT_THAT(doubtful.error().message, HasSubstr("veneerctl job settle"));
}

TEST(RedoMarks, UnknownMarksAndNothingMissingAreSaid) {
  const auto unknown = marks_to_redo(kSixPieces, kJob, {"A2", "Z9"}, false);
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(unknown.error().message, HasSubstr("job 7 has no piece Z9"));
  const auto whole = marks_to_redo(pieces({{"A1", State::kCut}}), kJob, {}, false);
  ASSERT_FALSE(whole.ok());
  EXPECT_EQ(whole.error().code, ErrorCode::kInvalidArgument);
}

TEST(RedoMarks, APieceThatWasFoundMeanwhileIsGood) {
  EXPECT_TRUE(none_is_good(kSixPieces, kJob, {"A2", "A3"}).ok());
  const Status found = none_is_good(kSixPieces, kJob, {"A2", "A6"});
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kConflict);
  EXPECT_THAT(found.error().message, HasSubstr("piece A6"));
}

}  // namespace
}  // namespace veneer::daemon
