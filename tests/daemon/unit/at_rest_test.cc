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

// ---- what would make a STOP wait ------------------------------------------------------------------------------------

TEST_F(AtRestTest, NothingMovesWhileTheCellWaitsOrIsAborted) {
  EXPECT_TRUE(runner_->nothing_moves());
  load_first_panel();
  ASSERT_EQ(state(), CellState::kSuspended);
  EXPECT_TRUE(runner_->nothing_moves());
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_TRUE(runner_->nothing_moves());
  laser_.beam_stays_on = true;
  EXPECT_FALSE(runner_->nothing_moves());
}

TEST_F(AtRestTest, SomethingMovesWhileItIsHomedOrJogged) {
  laser_.homes = false;
  tell(CellCommand::kReset);
  EXPECT_FALSE(runner_->nothing_moves()) << "it is being written that it begins";
  settle();
  EXPECT_FALSE(runner_->nothing_moves());
  laser_.say(laser_event::Homed{});
  settle();
  EXPECT_TRUE(runner_->nothing_moves());
  laser_.can_jog = true;
  {
    const SlowDatabase slow(*database_);
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test", [](const Status&) {});
    EXPECT_FALSE(runner_->nothing_moves()) << "it is being written that it begins";
  }
  settle();
  EXPECT_FALSE(runner_->nothing_moves());
  laser_.end_jog();
  settle();
  EXPECT_TRUE(runner_->nothing_moves());
}

TEST_F(AtRestTest, SomethingMovesWhileItIsCutOrHeld) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_FALSE(runner_->nothing_moves());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_FALSE(runner_->nothing_moves()) << "Unhold goes on";
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

TEST_F(MayBeWatchedTest, WhileTheHeadIsJogged) {
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  EXPECT_EQ(refusal(), "");
}

TEST_F(MayBeWatchedTest, NotWhileTheUnitLooksByItselfButWhileItCutsIsHeldAndAfterAnAbort) {
  laser_.burn_at_once = false;
  load_first_panel();
  EXPECT_THAT(refusal(), HasSubstr("looks at the bed by itself"));
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kExecute);
  EXPECT_EQ(refusal(), "");
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(refusal(), "");
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(refusal(), "");
}

TEST(MayBeWatched, InEachStateButThoseInWhichTheUnitLooksAgainAndAgain) {
  for (const CellState state :
       {CellState::kExecute, CellState::kHolding, CellState::kHeld, CellState::kUnholding, CellState::kCompleting,
        CellState::kComplete, CellState::kStopped, CellState::kIdle, CellState::kAborted, CellState::kResetting})
    EXPECT_TRUE(check_may_be_watched(state).ok()) << to_string(state);
  for (const CellState state :
       {CellState::kStarting, CellState::kSuspending, CellState::kSuspended, CellState::kUnsuspending})
    EXPECT_FALSE(check_may_be_watched(state).ok()) << to_string(state);
}

// ---- what each thing that goes on is in the way of ------------------------------------------------------------------

std::string words(const Status& status) { return status ? "" : status.error().message; }

struct GoesOn {
  const char* what;
  void (*set)(Doings&);
  bool ends, looks;  // what may be done all the same
};
constexpr GoesOn kGoesOn[] = {
    {"an activity", [](Doings& now) { now.activity = true; }, false, false},
    {"a jog", [](Doings& now) { now.jogging = true; }, false, false},
    {"a jog that is coming", [](Doings& now) { now.jog_coming = true; }, true, false},
    {"something on record", [](Doings& now) { now.on_record = true; }, false, true},
    {"the controller's reading", [](Doings& now) { now.reading = true; }, false, true},
    {"a write that is waited for", [](Doings& now) { now.committing = true; }, false, true},
    {"an end that is owed", [](Doings& now) { now.end_owed = true; }, false, false},
    {"the beam", [](Doings& now) { now.beam_on = true; }, false, false},
    {"a head that moves by itself", [](Doings& now) { now.stands_still = false; }, false, true},
};

TEST(Doings, AloneEachIsInTheWayOfWhatItWouldSpoil) {
  for (const CellState state : {CellState::kStopped, CellState::kIdle, CellState::kComplete}) {
    Doings rests;
    rests.state = state;
    EXPECT_EQ(words(check_booked(rests)), "");
    EXPECT_EQ(words(check_at_rest(rests)), "");
    EXPECT_TRUE(allows_owed_look(rests));
    for (const GoesOn& one : kGoesOn) {
      Doings now = rests;
      one.set(now);
      EXPECT_EQ(check_at_rest(now).ok(), one.ends) << one.what;
      EXPECT_EQ(allows_owed_look(now), one.looks) << one.what;
      EXPECT_EQ(check_booked(now).ok(), !now.committing && !now.end_owed) << one.what;
    }
  }
}

TEST(Doings, WhereTheHeadMayMoveNobodyEndsOrLooks) {
  for (const CellState state : {CellState::kResetting, CellState::kStarting, CellState::kExecute, CellState::kHolding,
                                CellState::kUnholding, CellState::kUnsuspending, CellState::kStopping}) {
    Doings now;
    now.state = state;
    EXPECT_FALSE(check_at_rest(now).ok()) << to_string(state);
    EXPECT_FALSE(allows_owed_look(now)) << to_string(state);
  }
}

}  // namespace
}  // namespace veneer::daemon
