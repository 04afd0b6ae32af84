// A run that is over before the camera could look once more leaves pieces that nobody has proven.
#include <gmock/gmock.h>

#include "tests/daemon/unit/proof_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

const Error kNothingThere{ErrorCode::kNotFound, "no panel is on the bed"};
const Error kDark{ErrorCode::kUnavailable, "the picture shows nothing: see that the light is on"};
const Error kSilent{ErrorCode::kUnavailable, "the camera is gone"};

class OwedProofTest : public ProofTest {
 protected:
  // The first piece is booked, the second is being burnt.
  void cut_one() {
    begin();
    laser_.finish();
    settle();
    ASSERT_EQ(starts(), 2);
  }
  // As the owner's timer does while nothing else happens.
  void wait_long() {
    for (int tick = 0; tick < 200; ++tick) look();
  }
  // Its picture is asked for; what it tells has not come yet. A later look tells nothing.
  void begin_a_look_at_nothing() {
    wait_long();
    bed_.before.assign(2, kNothingThere);
    const int looks = bed_.looks;
    while (bed_.looks == looks) runner_->look_again();
  }
  void expect_that_it_told_nothing() {
    EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
    bed_.lay("P-0001");
    wait_long();
    EXPECT_FALSE(runner_->view().owed_look) << "the next one proves them";
    EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  }
};

TEST_F(OwedProofTest, AStopAfterThePanelWasLiftedLeavesWhatWasBookedSuspect) {
  cut_one();
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_THAT(reason(), AllOf(HasSubstr("STOP"), HasSubstr("no panel is on the bed"), HasSubstr("is suspect")));
  EXPECT_EQ(runner_->view().job->suspect, 2);
}

TEST_F(OwedProofTest, AStopOverAPanelThatLiesAsItDidLeavesWhatWasBookedCut) {
  cut_one();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  bed_.seen = kNothingThere;  // it is proven, whatever becomes of the panel
  wait_long();
  restart();
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, TheLookComesAfterTheResetAndNothingMovesForIt) {
  cut_one();
  laser_.can_jog = true;
  laser_.position = point<MachineFrame>(15, 20);
  const int looks = bed_.looks;
  int looked_before = -1;
  laser_.on_abort = [&] { looked_before = bed_.looks; };
  const std::size_t said = laser_.calls.size();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  laser_.on_abort = {};  // the runner's end is another one
  EXPECT_EQ(looked_before, looks);
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_THAT(std::vector<std::string>(laser_.calls.begin() + static_cast<std::ptrdiff_t>(said), laser_.calls.end()),
              Each(std::string("abort")));
}

// A camera's file may be from before the panel was lifted.
TEST_F(OwedProofTest, APictureFromBeforeTheRunBrokeOffProvesNothing) {
  cut_one();
  const int hands = bed_.hands;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_GT(bed_.hands, hands);
}

TEST_F(OwedProofTest, ACameraThatSaysNothingIsAskedAgain) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  bed_.lay("P-0001", true, 300.5);
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_THAT(reason(), HasSubstr("moved by 0.50 mm"));
}

// Neither good nor lost: the panel may lie as it did, or be in somebody's hands.
TEST_F(OwedProofTest, ADarkPictureLeavesTheLookOwed) {
  cut_one();
  bed_.seen = kDark;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  restart();
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  bed_.lay("P-0001");
  wait_long();
  bed_.seen = kNothingThere;
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved)) << "it was seen to lie as it did";
}

TEST_F(OwedProofTest, ThatAPanelIsGoneIsBelievedOfTwoPictures) {
  cut_one();
  bed_.before = {kNothingThere};
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  EXPECT_FALSE(runner_->view().owed_look);
}

TEST_F(OwedProofTest, TheStatusTellsWhatIsOwedAndHowItIsPaid) {
  EXPECT_FALSE(runner_->view().owed_look);
  cut_one();
  EXPECT_FALSE(runner_->view().owed_look) << "the run will look itself";
  bed_.seen = kDark;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(runner_->view().owed_look);
  EXPECT_EQ(runner_->view().owed_look->job, JobId{1});
  EXPECT_EQ(runner_->view().owed_look->panel, PanelId{"P-0001"});
  EXPECT_EQ(runner_->view().owed_look->pieces, 1);
  EXPECT_THAT(runner_->view().owed_look->sentence,
              AllOf(HasSubstr("has not seen panel P-0001 since a piece of job 1 was cut"), HasSubstr("leave it as it"),
                    HasSubstr("see that the light is on"), HasSubstr("veneerctl write-off-look")));
  restart();
  EXPECT_TRUE(runner_->view().owed_look) << "a kill changes nothing";
  bed_.lay("P-0001");
  wait_long();
  EXPECT_FALSE(runner_->view().owed_look);
}

TEST_F(OwedProofTest, ThroughAnOpenLidTheStatusAsksForItToBeClosed) {
  cut_one();
  laser_.open_lid();
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(runner_->view().owed_look);
  EXPECT_THAT(runner_->view().owed_look->sentence, HasSubstr("(the lid is open, and it may be behind a hand)"));
}

// grblHAL's way out of its door: nobody has to close anything any more.
TEST_F(OwedProofTest, WhileTheControllerComesOutOfItsDoorTheLidIsNotSaidToBeOpen) {
  cut_one();
  laser_.leaves_door = true;
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(runner_->view().owed_look);
  EXPECT_THAT(runner_->view().owed_look->sentence,
              AllOf(HasSubstr("(the lid was open just now, and it may have been behind a hand)"),
                    Not(HasSubstr("the lid is open"))));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved)) << "it may be behind a hand";
}

TEST_F(OwedProofTest, WhatTheCameraCannotTellAPersonWritesOff) {
  cut_one();
  const auto write_off = [&] {
    std::optional<Status> out;
    runner_->write_off_look("anna", [&](Status s) { out = std::move(s); });
    settle();
    return *out;
  };
  EXPECT_EQ(write_off().error().code, ErrorCode::kConflict);
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(write_off().ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_THAT(reason(), AllOf(HasSubstr("anna says that nobody can look"), HasSubstr("veneerctl job settle 1")));
  EXPECT_FALSE(runner_->view().owed_look);
  restart();
  EXPECT_FALSE(runner_->view().owed_look);
}

// It would be booked as cut once there is room, behind the word that it is suspect.
TEST_F(OwedProofTest, NothingIsWrittenOffBeforeWhatWasCutIsBooked) {
  cut_one();
  bed_.seen = kSilent;
  std::optional<Status> refused;
  {
    const testing::LittleRoom full(0);
    laser_.finish();
    settle();
    ASSERT_EQ(state(), CellState::kAborted);
    runner_->write_off_look("anna", [&](Status s) { refused = std::move(s); });
    settle();
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->error().code, ErrorCode::kConflict);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(runner_->view().owed_look) << "the look is still owed";
  EXPECT_EQ(runner_->view().owed_look->pieces, 2);
}

TEST_F(OwedProofTest, WhatWasSeenIsNotForgottenWhileTheDiskIsFull) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  {
    const testing::LittleRoom full(0);
    bed_.seen = kNothingThere;
    wait_long();
  }
  bed_.lay("P-0001");  // where it lay before
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, WhatWasSeenStaysInTheStatusUntilItIsWritten) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  for (bool there : {false, true}) {
    const testing::LittleRoom full(0);
    if (there)
      bed_.lay("P-0001");
    else
      bed_.seen = kNothingThere;
    wait_long();
    ASSERT_TRUE(runner_->view().owed_look) << "what was seen first counts";
    EXPECT_THAT(runner_->view().owed_look->sentence, HasSubstr("still to be written: wait, or make room on the disk"));
    EXPECT_THAT(reason(), Not(HasSubstr("is suspect: say"))) << "it is not yet";
  }
  settle();
  EXPECT_FALSE(runner_->view().owed_look);
  EXPECT_THAT(reason(), HasSubstr("is suspect: say what became of it"));
}

// The head may be over the panel, or the beam in the picture.
TEST_F(OwedProofTest, ALookThatTheHeadMovedUnderIsTakenAgain) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_EQ(state(), CellState::kIdle);
  laser_.can_jog = true;
  begin_a_look_at_nothing();
  ASSERT_TRUE(jog(5).ok());
  laser_.end_jog();
  settle();
  expect_that_it_told_nothing();
}

TEST_F(OwedProofTest, ALookThatTheHeadIsHomedUnderIsTakenAgain) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  begin_a_look_at_nothing();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  expect_that_it_told_nothing();
}

// Its places are in another frame than those of the run: nobody can tell by it whether the panel lies as it did.
TEST_F(OwedProofTest, ALookByNewCertificatesProvesNothing) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  measure_axes_anew();
  bed_.lay("P-0001");
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_THAT(reason(), HasSubstr("the camera or the laser was calibrated anew since panel P-0001 was cut"));
  EXPECT_FALSE(runner_->view().owed_look);
}

TEST_F(OwedProofTest, WhatALookTellsAtRestIsInTheStatus) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_EQ(state(), CellState::kIdle);
  bed_.seen = kNothingThere;
  wait_long();
  EXPECT_THAT(reason(), AllOf(HasSubstr("no panel is on the bed"), HasSubstr("veneerctl job settle 1")));
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(reason(), "") << "it was in sight";
}

TEST_F(OwedProofTest, ASilentCameraIsAskedLessAndLessOften) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  const int looks = bed_.looks;
  wait_long();
  EXPECT_GT(bed_.looks, looks);
  EXPECT_LE(bed_.looks, looks + 10);
}

TEST_F(OwedProofTest, ThroughAnOpenLidAPanelIsSeenButNotMissed) {
  cut_one();
  laser_.open_lid();
  bed_.seen = kNothingThere;  // a hand is over its tags
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  bed_.lay("P-0001");
  wait_long();
  bed_.seen = kNothingThere;
  laser_.close_lid();
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, AKillLeavesWhatWasBookedToTheNextLook) {
  cut_one();
  bed_.seen = kNothingThere;
  restart();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_EQ(runner_->view().rest->suspect, 2);
}

TEST_F(OwedProofTest, WhatIsOwedOutlastsAnotherKill) {
  cut_one();
  bed_.seen = kSilent;
  restart();
  restart();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  bed_.seen = kNothingThere;
  restart();
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, WhatAPersonSaidIsNotDoubtedAgain) {
  cut_one();
  bed_.seen = kNothingThere;
  restart();
  ASSERT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  ASSERT_TRUE(database_
                  ->call([](Repositories& r) {
                    return r.jobs.settle(r.jobs.pieces(JobId{1})->front().id, db::AllocationState::kCut, kThen,
                                         "user anna");
                  })
                  .ok());
  restart();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, WhatWasProvenBeforeIsNotOwed) {
  options_.look_every = 1;
  make_runner();
  cut_one();
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  restart();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

TEST_F(OwedProofTest, TheAuditLogTellsUpToWhereThePanelWasSeen) {
  options_.look_every = 1;
  make_runner();
  cut_one();
  const auto rows = database_->call([](Repositories& r) {
    db::AuditFilter proofs;
    proofs.what = "run.proven";
    return r.audit.read(proofs, 10);
  });
  ASSERT_TRUE(rows.ok());
  std::vector<std::string> told;
  for (const auto& row : *rows) told.push_back(row.detail);
  EXPECT_THAT(told, ElementsAre("run 1 of job 1 on P-0001, 1 pieces cut before",
                                "run 1 of job 1 on P-0001, 0 pieces cut before"));
}

TEST_F(OwedProofTest, WithoutLooksNothingIsOwed) {
  options_.look_every = 0;
  make_runner();
  cut_one();
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  restart();
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

// The run that was killed was to look again.
TEST_F(OwedProofTest, WhatIsOwedIsSoThoughTheNextStartLooksNoMore) {
  cut_one();
  bed_.seen = kNothingThere;
  options_.look_every = 0;
  restart();
  wait_long();
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

// Nothing was asked of the camera between Hold and Stop.
TEST_F(OwedProofTest, StopOfAHeldRunOwesALookAsWell) {
  begin();
  laser_.finish();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  ASSERT_EQ(state(), CellState::kHeld);
  ASSERT_EQ(starts(), 1);
  bed_.seen = kNothingThere;
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

TEST_F(OwedProofTest, TheNextRunTellsAtTheLatest) {
  cut_one();
  bed_.seen = kSilent;
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  for (const auto next : {CellCommand::kClear, CellCommand::kReset}) ASSERT_TRUE(command(next).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
  laser_.open_lid();  // the owed look may miss the first panel, and waits
  bed_.lay("P-0002");
  look();
  laser_.close_lid();
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(starts(), 3);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kCutting));
}

}  // namespace
}  // namespace veneer::daemon
