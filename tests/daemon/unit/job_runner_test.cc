// The way of a job through its panels, and what breaks it off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/unit/job_words.h"
#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(JobRunnerTest, NothingIsAskedOfTheLaserBeforeAnOperatorsReset) {
  settle();
  look();
  EXPECT_TRUE(laser_.calls.empty());
  EXPECT_EQ(state(), CellState::kStopped);
}

TEST_F(JobRunnerTest, ResetConnectsAndHomes) {
  EXPECT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_THAT(laser_.calls, ElementsAre("connect", "home"));
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, ResetWithoutALaserEndsAbortedAndSaysWhy) {
  laser_.present = false;
  const Status reset = command(CellCommand::kReset);
  ASSERT_FALSE(reset.ok());
  EXPECT_THAT(reset.error().message, HasSubstr("no laser at this port"));
  EXPECT_EQ(state(), CellState::kAborted);
}

TEST_F(JobRunnerTest, TheCameraIsToldWheneverHandsMayHaveBeenAtTheBed) {
  laser_.burn_at_once = false;
  load_first_panel();
  EXPECT_EQ(bed_.hands, 2) << "Idle, Suspended";
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(bed_.hands, 3) << "what was proven once is no proof for later";
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  ASSERT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(bed_.hands, 4);
}

TEST_F(JobRunnerTest, StartWaitsSuspendedForTheFirstPanel) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  ASSERT_TRUE(runner_->view().load);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0001");
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, UnsuspendIsRefusedUntilTheRightPanelLiesBackUp) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message,
              HasSubstr("P-0002 is on the bed, but P-0001 is wanted"));
  bed_.lay("P-0001", false);
  look();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("turn it over"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, APanelThatMovedSinceItWasShownIsRefused) {
  load_first_panel();
  bed_.lay("P-0001", true, 301);
  const Status unsuspended = command(CellCommand::kUnsuspend);
  ASSERT_FALSE(unsuspended.ok());
  EXPECT_THAT(unsuspended.error().message, HasSubstr("moved by 1.00 mm"));
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, CutsPanelByPanelAndAsksForTheOperatorsWordEachTime) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(laser_.burnt.size(), 2U);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kComplete);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kCut));
  EXPECT_EQ(job_state(), db::JobState::kComplete);
  laser_.can_jog = true;
  EXPECT_TRUE(jog(20).ok()) << "to reach what was cut";
}

TEST_F(JobRunnerTest, ARunRemembersWhoGaveTheWordAndOnWhatItStood) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  const auto facts = database_->call([](Repositories& r) { return r.jobs.facts(r.jobs.runs(JobId{1})->front().id); });
  ASSERT_TRUE(facts.ok()) << facts.error().message;
  EXPECT_EQ(facts->who, "test");
  EXPECT_THAT(facts->certificates, ElementsAre(CertificateId{1}, CertificateId{2}, CertificateId{3}));
  EXPECT_EQ(facts->recipes_json, R"([{"material": null}])");
}

TEST_F(JobRunnerTest, APieceIsNotedBeforeItsFirstStroke) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCutting, P::kReserved, P::kReserved));
}

TEST_F(JobRunnerTest, StopReachesTheLaserAtOnceAndLeavesThePieceSuspect) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.calls.clear();
  runner_->abort("STOP");
  EXPECT_THAT(laser_.calls, ElementsAre("abort"));  // before the reactor turns once
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("piece A1-1 is suspect")) << "so that it can be found and settled";
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
}

TEST_F(JobRunnerTest, ALostLinkEndsAbortedAndNothingGoesOnByItself) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.fail({ErrorCode::kDisconnected, "the laser's link is gone"});
  settle();
  laser_.calls.clear();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_FALSE(start().ok());
  EXPECT_TRUE(laser_.calls.empty());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

// Nothing that was proven is forgotten, and the cell goes on without a restart once there is room.
TEST_F(JobRunnerTest, WhatAFullDiskDidNotTakeIsWrittenByTheNextClear) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const testing::LittleRoom full(0);
    laser_.finish();
    settle();
    EXPECT_EQ(state(), CellState::kAborted);
    EXPECT_THAT(runner_->view().reason, AllOf(HasSubstr("could not be booked"), HasSubstr("make room on the disk")));
    EXPECT_THAT(laser_.calls, Contains("abort"));
    const Status early = command(CellCommand::kClear);
    ASSERT_FALSE(early.ok());
    EXPECT_THAT(early.error().message, HasSubstr("make room on the disk"));
    EXPECT_EQ(state(), CellState::kAborted);
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
  laser_.burn_at_once = true;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, AStopWhileAClearIsWritingForgetsNothing) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const testing::LittleRoom full(0);
    laser_.finish();
    settle();
    Status cleared = Ok();
    tell(CellCommand::kClear, [&](const Status& answer) { cleared = answer; });
    ASSERT_EQ(state(), CellState::kClearing);
    runner_->abort("STOP");
    settle();
    EXPECT_FALSE(cleared.ok()) << "a Clear that was cut short is answered";
    EXPECT_EQ(state(), CellState::kAborted);
    EXPECT_THAT(runner_->view().reason, AllOf(HasSubstr("STOP"), HasSubstr("make room on the disk")));
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
}

TEST_F(JobRunnerTest, APieceBrokenOffUnderAFullDiskIsSuspectAfterTheClear) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const testing::LittleRoom full(0);
    runner_->abort("STOP");
    settle();
    EXPECT_EQ(state(), CellState::kAborted);
    EXPECT_THAT(runner_->view().reason, AllOf(HasSubstr("STOP"), HasSubstr("make room on the disk")));
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kAborted);
}

TEST_F(JobRunnerTest, TheRemainingPiecesCanBeCutAfterClearAndReset) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.fail({ErrorCode::kDeviceFault, "ALARM:1"});
  settle();
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, AJobWithNothingToCutSaysWhatIsLeftToDo) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  runner_->abort("STOP");
  settle();
  ASSERT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kSuspect));
  const auto refused = [this] {
    EXPECT_TRUE(state() == CellState::kIdle || ((state() != CellState::kAborted || command(CellCommand::kClear).ok()) &&
                                                command(CellCommand::kReset).ok()));
    const Status started = start();
    return started.ok() ? std::string("it started") : started.error().message;
  };
  EXPECT_THAT(refused(), HasSubstr("1 is suspect: look at it, and say what you saw with veneerctl job settle 1"));
  const auto last = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); })->back().id;
  ASSERT_TRUE(database_
                  ->call([last](Repositories& r) {
                    return r.jobs.settle(last, db::AllocationState::kScrap, "2026-05-01T08:00:00Z", "user anna");
                  })
                  .ok());
  EXPECT_THAT(refused(), HasSubstr("1 is missing: find other wood with veneerctl job redo 1"));
}

TEST_F(JobRunnerTest, HoldStopsInThePieceAndUnholdGoesOn) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);  // both pieces cut, waiting for the second panel
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, UnholdUnderAnOpenLidStaysHeldAndSaysSo) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  laser_.open_lid();
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, HasSubstr("the lid is open: close it; then Unhold"));
  EXPECT_EQ(state(), CellState::kHeld);
}

TEST_F(JobRunnerTest, ALidOpenedBetweenTwoPiecesHoldsUntilTheOperatorSaysSo) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.open_and_close_lid();  // in the instant between this piece and the next
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "start"), 1);
  laser_.open_lid();
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("lid is open"));
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.close_lid();
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  settle();
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "start"), 2);
}

TEST_F(JobRunnerTest, AMachineThatDropsOutAtRestEndsAborted) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "the laser was unplugged"}, false});
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("unplugged"));
}

TEST_F(JobRunnerTest, StopAfterThisPieceFinishesItAndLeavesTheRestReserved) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  Status taken = Ok();
  runner_->stop_after_piece("test", [&](Status s) { taken = std::move(s); });
  EXPECT_TRUE(taken.ok());
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
  EXPECT_EQ(job_state(), db::JobState::kStopped);
}

TEST_F(JobRunnerTest, StopWhileSuspendedLeavesTheJobToBeStartedAgain) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_TRUE(start().ok());
}

TEST_F(JobRunnerTest, AfterACrashTheCellIsAbortedUntilSomebodyLooks) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  auto recovery = database_->call([](Repositories& r) { return r.jobs.recover(kThen); });  // as the next start does
  ASSERT_TRUE(recovery.ok());
  make_runner();
  runner_->begin(*recovery);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("one piece is suspect"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
  settle();
  EXPECT_EQ(next_words(runner_->view(), {}),
            "0 of 3 pieces of job 1 are cut, 1 is suspect and 2 are still to be cut: Clear, Reset, look at the "
            "suspect piece and say what became of it (veneerctl job settle 1), then Start cuts the rest (veneerctl job "
            "start 1)");
  ASSERT_TRUE(database_
                  ->call([](Repositories& r) {
                    return r.jobs.settle(PieceId{1}, db::AllocationState::kCut, kThen, "user anna");
                  })
                  .ok());
  runner_->job_changed(JobId{1});
  settle();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(next_words(runner_->view(), {}),
            "1 of 3 pieces of job 1 is cut and 2 are still to be cut: Start cuts the rest (veneerctl job start 1)");
  laser_.burn_at_once = true;
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(next_words(runner_->view(), {}), "");
}

TEST_F(JobRunnerTest, TellsWhatItDoesWithAJob) {
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "");
  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(job_state(), db::JobState::kPlanned) << "as no run has begun";
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "waits for panel P-0001");
  EXPECT_EQ(now_words(runner_->view(), JobId{2}), "");
  bed_.lay("P-0001");
  look();
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "waits for an operator's Unsuspend, with panel P-0001 found");
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "is cutting piece A1-1");
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "is held");
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(now_words(runner_->view(), JobId{1}), "");
}

}  // namespace
}  // namespace veneer::daemon
