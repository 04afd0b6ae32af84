// Tracing the frame of what is about to be cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(JobRunnerTest, TheFrameIsTracedDarkAndCutsNothing) {
  EXPECT_THAT(frame().error().message, HasSubstr("start a job"));
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(frame().error().message, sentence());  // a job was started already: what it waits for is said
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(frame().ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].power.count(), 0);
  EXPECT_EQ(laser_.jobs[0].strokes[0].path.front(), laser_.jobs[0].strokes[0].path.back());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(runner_->view().framing);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, TheFrameTakesALowPowerAndNoMore) {
  load_first_panel();
  EXPECT_THAT(frame(0.5).error().message, HasSubstr("at most 3.0 % power"));
  EXPECT_FALSE(frame(-0.1).ok());
  EXPECT_FALSE(frame(std::nan("")).ok());
  ASSERT_TRUE(frame(0.02).ok());
  EXPECT_DOUBLE_EQ(laser_.jobs.at(0).strokes[0].power.count(), 0.02);
}

TEST_F(JobRunnerTest, WhileTheFrameIsTracedNothingElseBeginsAndStopStops) {
  load_first_panel();
  laser_.burn_at_once = false;
  std::optional<Status> traced;
  runner_->frame(PowerFraction(0), "test", [&](Status s) { traced = std::move(s); }, {});
  settle();
  EXPECT_TRUE(runner_->view().framing);
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("tracing the frame"));
  EXPECT_FALSE(frame().ok());
  EXPECT_FALSE(traced);
  laser_.calls.clear();
  runner_->abort("STOP");
  EXPECT_THAT(laser_.calls, ElementsAre("abort"));
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  ASSERT_TRUE(traced);
  EXPECT_FALSE(traced->ok());
  EXPECT_FALSE(runner_->view().framing);
}

TEST_F(JobRunnerTest, HoldEndsAFrameBeamFirst) {
  load_first_panel();
  laser_.burn_at_once = false;
  runner_->frame(PowerFraction(0.02), "test", [](const Status&) {}, {});
  settle();
  ASSERT_TRUE(runner_->view().framing);
  EXPECT_TRUE(runner_->may_move());
  laser_.calls.clear();
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(laser_.calls.front(), "abort");
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("held while tracing the frame"));
  EXPECT_FALSE(runner_->may_move());
}

TEST_F(JobRunnerTest, HoldWhileTheBedIsLookedAtForAFrameGivesItUp) {
  load_first_panel();
  std::optional<Status> traced;
  runner_->frame(PowerFraction(0.02), "test", [&](Status s) { traced = std::move(s); }, {});
  ASSERT_TRUE(runner_->view().framing);
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  settle();
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(runner_->view().framing);
  EXPECT_THAT(laser_.jobs, ::testing::IsEmpty());
  ASSERT_TRUE(traced);
  EXPECT_FALSE(traced->ok());
}

TEST_F(JobRunnerTest, ALidOpenedOverTheFrameEndsIt) {
  load_first_panel();
  laser_.burn_at_once = false;
  runner_->frame(PowerFraction(0), "test", [](const Status&) {}, {});
  settle();
  laser_.say(laser_event::Held{});
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(laser_.calls, Contains("abort"));
}

TEST_F(JobRunnerTest, AFrameNeedsTheSameConfirmationsOnceItsBeamIsOn) {
  options_.confirm = {"exhaust"};
  make_runner();
  load_first_panel();
  EXPECT_THAT(frame(0.02).error().message, HasSubstr("exhaust"));
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_TRUE(frame(0.02, {"exhaust"}).ok());
  EXPECT_TRUE(frame(0).ok());
}

}  // namespace
}  // namespace veneer::daemon
