// A proof of the pose holds until the lid opens or a hand could have been in.
#include <gmock/gmock.h>

#include "daemon/unit/job_words.h"
#include "tests/daemon/unit/proof_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// ---- From Unsuspend to the first stroke --------------------------------------------------------------------------

TEST_F(ProofTest, ALidOpenedWhileTheCameraLooksMakesThePictureWorthNothing) {
  load_first_panel();
  std::optional<Status> unsuspended;
  tell(CellCommand::kUnsuspend, [&](Status s) { unsuspended = std::move(s); });
  laser_.open_and_close_lid();  // the picture is taken, and now the panel is nudged
  bed_.lay("P-0001", true, 303.4);
  settle();
  ASSERT_TRUE(unsuspended);
  ASSERT_FALSE(unsuspended->ok());
  EXPECT_THAT(unsuspended->error().message, HasSubstr("lid was opened"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), 0);
}

TEST_F(ProofTest, APictureTakenUnderAnOpenLidProvesNothing) {
  load_first_panel();
  laser_.open_lid();
  std::optional<Status> unsuspended;
  tell(CellCommand::kUnsuspend, [&](Status s) { unsuspended = std::move(s); });
  bed_.lay("P-0001", true, 303.4);
  laser_.close_lid();  // the opening was counted before the picture, the hands were in after it
  settle();
  ASSERT_TRUE(unsuspended);
  EXPECT_FALSE(unsuspended->ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), 0);
}

TEST_F(ProofTest, ALidOpenedBetweenTheProofAndTheFirstStrokeHolds) {
  load_first_panel();
  bed_.on_prepare = [this] {
    laser_.open_and_close_lid();
    bed_.lay("P-0001", true, 303.4);
  };
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), HasSubstr("lid was opened"));
  EXPECT_EQ(starts(), 0);
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, AllOf(HasSubstr("panel P-0001 moved by 3.40 mm"), HasSubstr("Unhold")));
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 0);
  // Nothing was begun, so the panel can be proven anew from the start.
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
}

TEST_F(ProofTest, ALidOpenedAfterThePieceWasNotedHolds) {
  load_first_panel();
  std::optional<SlowDatabase> slow;
  bed_.on_prepare = [&] {
    if (state() == CellState::kUnsuspending) slow.emplace(*database_);
  };
  tell(CellCommand::kUnsuspend);
  poll();
  ASSERT_TRUE(slow);
  slow.reset();
  while (state() != CellState::kExecute) turn();
  laser_.open_and_close_lid();  // its note is on the way to the disk
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 0);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 1);
}

TEST_F(ProofTest, TheLidThroughWhichThePanelWasLaidUndoesNothing) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  laser_.open_and_close_lid();
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kExecute);
  EXPECT_EQ(starts(), 1);
}

// ---- From Held to Unhold -----------------------------------------------------------------------------------------

TEST_F(ProofTest, UnholdLooksAgainAndRefusesAPanelThatMovedUnderAHeldPiece) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  bed_.lay("P-0001", true, 300.4);
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, HasSubstr("moved by 0.40 mm since its first piece was begun"));
  EXPECT_EQ(reason(), unheld.error().message);
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(laser_.calls, Not(Contains("resume")));
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("no panel is on the bed"));
  bed_.lay("P-0002");
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  bed_.lay("P-0001", true, 300.05);  // laid back, as well as hands can
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_THAT(laser_.calls, Contains("resume"));
}

TEST_F(ProofTest, UnholdLooksBetweenTwoPiecesAsWell) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  const int looks = bed_.looks;
  laser_.finish();
  laser_.on_hold = tests::SimLaser::OnHold::kNothing;
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  bed_.lay("P-0001", true, 299);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 1);
}

TEST_F(ProofTest, ALidOpenedWhileUnholdLooksHoldsOn) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  std::optional<Status> unheld;
  tell(CellCommand::kUnhold, [&](Status s) { unheld = std::move(s); });
  laser_.open_and_close_lid();
  settle();
  ASSERT_TRUE(unheld);
  EXPECT_FALSE(unheld->ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(laser_.calls, Not(Contains("resume")));
}

// ---- Every so many pieces ----------------------------------------------------------------------------------------

class LookEveryPiece : public ProofTest {
 protected:
  void SetUp() override {
    ProofTest::SetUp();
    options_.look_every = 1;
    make_runner();
  }
};

TEST_F(LookEveryPiece, TheCameraLooksAgainAndTheRunGoesOn) {
  begin();
  const int looks = bed_.looks;
  laser_.finish();
  settle();
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 2);
  EXPECT_EQ(state(), CellState::kExecute);
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kSuspended);
}

// A camera that is a file would show the first proof's picture for ever.
TEST_F(LookEveryPiece, EachLookWantsAPictureFromAfterTheLastProof) {
  begin();
  const int told = bed_.hands;
  laser_.finish();
  settle();
  ASSERT_EQ(starts(), 2);
  EXPECT_EQ(bed_.hands, told + 1);
}

TEST_F(LookEveryPiece, APanelThatCreptHoldsTheRunBeforeItsNextPiece) {
  begin();
  bed_.lay("P-0001", true, 300.5);
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), AllOf(HasSubstr("moved by 0.50 mm"), HasSubstr("piece A1-1 was cut since")));
  EXPECT_EQ(starts(), 1);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved)) << "before it crept, or after?";
}

// What was proven by a look is not put in doubt by a later one.
TEST_F(LookEveryPiece, OnlyPiecesSinceTheLastProofAreInDoubt) {
  begin();
  laser_.finish();
  settle();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

// ---- Before the end ----------------------------------------------------------------------------------------------

// A job of fewer pieces than RunnerOptions::look_every.
TEST_F(ProofTest, APanelThatWasLiftedInMidCutLeavesItsPiecesSuspect) {
  begin();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), AllOf(HasSubstr("no panel is on the bed"), HasSubstr("pieces A1-1, A1-2 were cut since"),
                              HasSubstr("bare bed")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_EQ(runner_->view().job->suspect, 2);
  EXPECT_EQ(runner_->view().job->cut, 0);
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(job_state(), db::JobState::kStopped);
  EXPECT_THAT(next_words(runner_->view(), {}),
              "0 of 3 pieces of job 1 are cut, 2 are suspect and 1 is still to be cut: Reset, look at the suspect "
              "pieces and say what became of each (veneerctl job settle 1), then Start cuts the rest (veneerctl job "
              "start 1)");
}

// The panel slipped under the first piece, and hands came through the lid afterwards.
TEST_F(ProofTest, ALidThatIsOpenedLaterDoesNotExplainAPanelThatMoved) {
  begin();
  bed_.lay("P-0001", true, 300.5);
  laser_.finish();
  laser_.open_and_close_lid();
  settle();
  ASSERT_EQ(state(), CellState::kHeld);
  ASSERT_EQ(starts(), 1);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_THAT(reason(), AllOf(HasSubstr("moved by 0.50 mm"), HasSubstr("piece A1-1 was cut since")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

TEST_F(ProofTest, HandsThatComeThroughTheLidForTheLastPieceAreAskedToLetTheCameraLook) {
  begin();
  laser_.finish();
  settle();
  laser_.finish();
  laser_.open_lid();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), AllOf(HasSubstr("before the camera had seen"), HasSubstr("close it, then Unhold")));
  EXPECT_FALSE(command(CellCommand::kUnhold).ok()) << "it is open";
  laser_.close_lid();
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended) << "for the second panel";
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, APanelThatHandsTookAwayBeforeTheCameraLookedLeavesItsPiecesSuspect) {
  begin();
  laser_.finish();
  settle();
  laser_.finish();
  laser_.open_lid();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  settle();
  laser_.close_lid();
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

// What the camera saw counts, whatever hands do while it is being looked at.
TEST_F(ProofTest, ALidThatIsOpenedWhileTheLastLookGoesOnUndoesNothing) {
  begin();
  laser_.finish();
  settle();
  const int looks = bed_.looks;
  laser_.finish();
  while (bed_.looks == looks) {
    database_->call([](Repositories&) { return 0; });
    turn();
  }
  laser_.open_lid();
  settle();
  EXPECT_EQ(state(), CellState::kSuspended) << "for the second panel";
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, ACameraThatDoesNotAnswerAtTheEndIsWaitedForUntilTheOperatorEndsIt) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(reason(), HasSubstr("2 pieces are suspect"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

// The lamp goes out, or the lens is covered.
TEST_F(ProofTest, APictureThatShowsNothingMakesNothingSuspect) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the picture shows nothing: see that the light is on"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld) << "nor does the run go on";
  EXPECT_THAT(reason(), AllOf(HasSubstr("see that the light is on"), HasSubstr("put that right and Unhold"),
                              HasSubstr("Stop leaves what was cut since it was last seen (2 pieces) suspect")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  bed_.lay("P-0001");
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, OneBrokenPictureAtTheEndMakesNothingSuspect) {
  begin();
  laser_.finish();
  settle();
  bed_.before = {Error{ErrorCode::kNotFound, "no panel is on the bed"}};
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

// A camera that is a file may show it as it lay before hands lifted it.
TEST_F(ProofTest, TheLastLookWantsAPictureFromAfterTheLastCut) {
  begin();
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(bed_.cuts, 2);
  EXPECT_EQ(bed_.cuts_at_look, 2) << "it was told before the camera was asked";
}

TEST_F(ProofTest, ACameraThatIsBackProvesWhatWasCut) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kHeld);
  bed_.lay("P-0001");
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, StopInsteadOfALookThatIsOwedLeavesThePiecesSuspect) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(LookEveryPiece, HoldWhileTheCameraLooksHolds) {
  begin();
  laser_.finish();
  while (runner_->view().job->cut < 1) {  // booked, and the look is asked for
    database_->call([](Repositories&) { return 0; });
    turn();
  }
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 2);
}

TEST_F(LookEveryPiece, TheHeadLeavesThePictureFirst) {
  laser_.can_jog = true;
  begin();
  laser_.position = point<MachineFrame>(15, 20);
  const int looks = bed_.looks;
  laser_.finish();
  settle();
  EXPECT_EQ(laser_.calls.back(), "jog");
  EXPECT_EQ(bed_.looks, looks) << "the head is still in the picture";
  EXPECT_EQ(starts(), 1);
  laser_.end_jog();
  settle();
  EXPECT_EQ(laser_.position, point<MachineFrame>(0, 0)) << "where it stood after homing";
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 2);
}

TEST_F(LookEveryPiece, HoldOnTheHeadsWayOutOfThePictureHolds) {
  laser_.can_jog = true;
  begin();
  laser_.position = point<MachineFrame>(15, 20);
  laser_.finish();
  settle();
  ASSERT_EQ(laser_.calls.back(), "jog");
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(laser_.calls.back(), "stop_jog");
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
}

TEST_F(LookEveryPiece, TheHeadNeverCrossesAForbiddenZoneForIt) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(4, 4));
  clamp.add(point<MachineFrame>(6, 30));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  laser_.can_jog = true;
  laser_.position = point<MachineFrame>(8, 8);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.position = point<MachineFrame>(15, 20);  // home is behind the clamp
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  const int looks = bed_.looks;
  laser_.position = point<MachineFrame>(8, 8);
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.position = point<MachineFrame>(3, 20);
  laser_.finish();
  settle();
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
  EXPECT_EQ(bed_.looks, looks + 2);
}

}  // namespace
}  // namespace veneer::daemon
