// Cutting again what was not through.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(JobRunnerTest, OnlyTheCutOfAPieceIsRepeatedAndItIsBookedOnce) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended);  // the second panel is waited for, the first still lies there
  EXPECT_EQ(runner_->view().can_recut, 2);
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-2"}).ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].role, StrokeRole::kCut);
  EXPECT_EQ(laser_.jobs[0].strokes[0].piece.value, 2);
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
  EXPECT_EQ(runner_->view().job->cut, 2);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, ACompleteJobCanBeCutAgainAlsoAfterReset) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("not cut from panel P-0002"));  // another panel's
  ASSERT_TRUE(recut({"A1-3"}).ok());
  EXPECT_EQ(state(), CellState::kComplete);
  EXPECT_EQ(job_state(), db::JobState::kComplete);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().recut_job, JobId{1});
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-3"}).ok());
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(laser_.jobs.size(), 1U);
  bed_.lay("P-0002", true, 300.2);
  EXPECT_THAT(recut({"A1-3"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(laser_.jobs.size(), 1U);
}

// No job is current after Reset, but the wood that is burnt is still booked as narrow as the kerf was measured.
TEST_F(JobRunnerTest, WhatIsCutAgainAfterResetKeepsToTheBookedKerf) {
  laser_.can_override = true;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.burn_at_once = false;
  static_cast<void>(recut({"A1-3"}));
  ASSERT_EQ(state(), CellState::kExecute);
  ASSERT_TRUE(laser_.burning());
  const Status slow = runner_->overrides().set({25, 100, 100});
  ASSERT_FALSE(slow.ok());
  EXPECT_THAT(slow.error().message, HasSubstr("kerf"));
  EXPECT_EQ(laser_.overrides, LaserOverrides{});
  EXPECT_TRUE(runner_->overrides().set({50, 100, 50}).ok());
}

// What was cut is in the database, with the strokes that cut it.
TEST_F(JobRunnerTest, CutsCanBeMetAgainAfterARestart) {
  laser_.identity = "the laser";
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  const LaserJob before = laser_.jobs.at(1);
  restart();
  EXPECT_EQ(runner_->view().can_recut, 2);
  EXPECT_EQ(runner_->view().recut_panel.value, "P-0001");
  EXPECT_EQ(runner_->view().recut_job, JobId{1});
  laser_.jobs.clear();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_FALSE(recut({"A1-2"}).ok()) << "nothing moves before Reset";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(recut({"A1-2"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  EXPECT_TRUE(laser_.jobs.empty());
  bed_.lay("P-0001");
  ASSERT_TRUE(recut({"A1-2"}).ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  const Stroke& again = laser_.jobs[0].strokes[0];
  const Stroke& cut = before.strokes.back();
  EXPECT_EQ(again.role, StrokeRole::kCut);
  EXPECT_EQ(again.piece.value, 2);
  EXPECT_EQ(again.path, cut.path);
  EXPECT_EQ(again.speed, cut.speed);
  EXPECT_EQ(again.power, cut.power);
  EXPECT_EQ(again.passes, cut.passes);
  EXPECT_EQ(again.air, cut.air);
}

TEST_F(JobRunnerTest, CutsOfAnotherLaserAreForgottenAlsoAfterARestart) {
  laser_.identity = "the laser";
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.identity = "another";
  restart();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().can_recut, 0);
  EXPECT_FALSE(recut({"A1-2"}).ok());
  restart();
  EXPECT_EQ(runner_->view().can_recut, 0) << "not even on the first one";
}

TEST_F(JobRunnerTest, NothingIsCutAgainOnceTheAxesWereMeasuredAnew) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  measure_axes_anew();
  laser_.jobs.clear();
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("the axes certificate is another"));
  EXPECT_TRUE(laser_.jobs.empty());
}

TEST_F(JobRunnerTest, NothingIsCutAgainOnAnotherLaser) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "unplugged"}, false});
  settle();
  ASSERT_EQ(state(), CellState::kAborted);
  EXPECT_EQ(runner_->view().can_recut, 2);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  laser_.identity = "another";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().can_recut, 0);
  EXPECT_FALSE(recut({"A1-1"}).ok());
}

// Its wood may be kept for another piece by now.
TEST_F(JobRunnerTest, APieceThatIsNoLongerBookedAsCutIsNotCutAgain) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(database_->call([](Repositories& r) { return r.jobs.make_suspect({{PieceId{2}}}, kThen); }).ok());
  laser_.jobs.clear();
  EXPECT_THAT(recut({"A1-2"}).error().message, HasSubstr("piece A1-2 is suspect"));
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_TRUE(recut({"A1-1"}).ok());
}

TEST_F(JobRunnerTest, APanelThatMovedIsNotCutAgain) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.jobs.clear();
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  bed_.lay("P-0002");
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_EQ(state(), CellState::kSuspended);
}

TEST_F(JobRunnerTest, ARecutNeedsTheSameConfirmationsAndAClosedLid) {
  options_.confirm = {"exhaust"};
  make_runner();
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_FALSE(recut({}, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A9-9"}, {"exhaust"}).ok());
  laser_.lid_open = true;
  EXPECT_THAT(recut({"A1-1"}, {"exhaust"}).error().message, HasSubstr("lid is open"));
  laser_.lid_open = false;
  EXPECT_TRUE(recut({"A1-1"}, {"exhaust"}).ok());
}

TEST_F(JobRunnerTest, ARecutThatIsBrokenOffNamesThePiece) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-2"}).ok());
  EXPECT_EQ(state(), CellState::kExecute);
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("piece A1-2 was being cut again: look at it"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().can_recut, 2);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.burn_at_once = true;
  EXPECT_TRUE(recut({"A1-2"}).ok());
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, ALidOpenedBetweenTwoRecutsHoldsThem) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  laser_.open_and_close_lid();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(runner_->view().reason, HasSubstr("lid was opened"));
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  bed_.lay("P-0001");
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
}

TEST_F(JobRunnerTest, ARecutCanBeHeld) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
}

// Two people at two screens: what the second asks for meanwhile is refused, and the first one's recut goes on unharmed.
TEST_F(JobRunnerTest, ASecondClientCannotInterfereWithARecutExceptToStopIt) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_FALSE(start().ok());
  EXPECT_FALSE(frame().ok());
  for (const auto other : {CellCommand::kUnsuspend, CellCommand::kReset, CellCommand::kUnhold, CellCommand::kClear})
    EXPECT_FALSE(command(other).ok());
  EXPECT_TRUE(laser_.jobs.empty()) << "nothing was burnt in between";
  EXPECT_EQ(state(), CellState::kExecute);
  laser_.finish();
  settle();
  ASSERT_EQ(laser_.jobs.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].piece.value, 1);
  EXPECT_EQ(state(), CellState::kExecute) << "the first one's second piece";
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, StopAfterThisPieceLetsThePanelLeaveAndTheRestBeCutInANewPose) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  runner_->stop_after_piece("test", [](const Status&) {});
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(runner_->view().can_recut, 1);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001", true, 250);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

}  // namespace
}  // namespace veneer::daemon
