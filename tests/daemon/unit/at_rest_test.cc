// When the program may end for somebody's convenience: nothing moves, burns, runs or waits, and all is booked. And when
// people may have pictures of the bed.
#include <gmock/gmock.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class AtRestTest : public JobRunnerTest {
 protected:
  std::string refusal() const {
    const Status rests = runner_->at_rest();
    return rests ? "" : rests.error().message;
  }
};

TEST_F(AtRestTest, BeforeTheFirstResetAndWhileIdle) {
  EXPECT_EQ(refusal(), "");
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(AtRestTest, NotWhileTheHeadIsJogged) {
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(refusal(), "the head moves: wait until it stands still");
  laser_.end_jog();
  settle();
  EXPECT_EQ(refusal(), "");
}

TEST_F(AtRestTest, AStopInTheMiddleOfAJogLeavesNothingThatWouldMoveForEver) {
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(AtRestTest, NotWhileAPanelWaitsIsCutOrIsHeld) {
  laser_.burn_at_once = false;
  load_first_panel();
  EXPECT_THAT(refusal(), HasSubstr("the cell is Suspended"));
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(refusal(), HasSubstr("the cell is Execute"));
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_THAT(refusal(), HasSubstr("the cell is Held"));
}

// A restart would be a way around Clear.
TEST_F(AtRestTest, NotAfterAnAbortThatNobodyCleared) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(refusal(), "the cell is Aborted: look at why, then Clear it");
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(AtRestTest, NotWhileTheEndOfARunIsStillToBeBooked) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const testing::LittleRoom full(0);
    laser_.finish();
    settle();
    EXPECT_THAT(refusal(), HasSubstr("still to be booked"));
    ASSERT_FALSE(command(CellCommand::kClear).ok());
    EXPECT_THAT(refusal(), HasSubstr("still to be booked"));
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(AtRestTest, NotWhileTheDatabaseTakesItsTimeWithTheEnd) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const SlowDatabase slow(*database_);
    runner_->abort("STOP");
    poll();
    EXPECT_THAT(refusal(), HasSubstr("still to be booked"));
  }
  settle();
  EXPECT_THAT(refusal(), HasSubstr("Aborted"));
}

// ---- watching the bed -----------------------------------------------------------------------------------------------

class MayBeWatchedTest : public JobRunnerTest {
 protected:
  std::string refusal() const {
    const Status may = runner_->may_be_watched();
    return may ? "" : may.error().message;
  }
};

TEST_F(MayBeWatchedTest, WhileTheHeadRests) {
  EXPECT_EQ(refusal(), "");
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(MayBeWatchedTest, NotWhileTheHeadIsJogged) {
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  EXPECT_EQ(refusal(), "the head moves: wait until it stands still");
  laser_.end_jog();
  settle();
  EXPECT_EQ(refusal(), "");
}

TEST_F(MayBeWatchedTest, NotWhileTheUnitLooksByItselfOrCutsButWhileItIsHeldAndAfterAnAbort) {
  laser_.burn_at_once = false;
  load_first_panel();
  EXPECT_THAT(refusal(), HasSubstr("looks at the bed by itself"));
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(refusal(), "the cell is Execute, and the head may move: wait until it rests");
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(refusal(), "");
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(refusal(), "");
}

}  // namespace
}  // namespace veneer::daemon
