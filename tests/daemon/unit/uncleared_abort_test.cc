// An abort is left by a person's Clear, and by no end of the program.
#include <gmock/gmock.h>

#include "daemon/unit/job_words.h"
#include "tests/daemon/unit/job_runner_fixture.h"
#include "tests/db/noted_aborts.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class UnclearedAbort : public JobRunnerTest {
 protected:
  // The program is told to end, and is started again.
  void end_and_start_again() {
    runner_->end("the daemon was told to end");
    settle();
    restart();
  }
  std::vector<std::string> noted() { return db::noted_aborts(dir_.path() / "test.db"); }
};

TEST_F(UnclearedAbort, AKillIsToBeClearedThoughTheProgramEndsInOrderSince) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  restart();
  ASSERT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), HasSubstr("stopped in the middle of job 1, and one piece is suspect"));
  for (int start = 0; start < 2; ++start) {
    end_and_start_again();
    EXPECT_EQ(state(), CellState::kAborted) << "nobody has cleared it";
    EXPECT_THAT(reason(), AllOf(HasSubstr("in the middle of job 1"), HasSubstr("nobody has cleared that since"),
                                HasSubstr("Clear and Reset")));
    EXPECT_FALSE(command(CellCommand::kReset).ok()) << "a restart is no way around Clear";
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  end_and_start_again();
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(job_state(), db::JobState::kAborted) << "it waits for a person's Start all the same";
}

TEST_F(UnclearedAbort, SoIsAStopWithJobOrWithout) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  end_and_start_again();
  ASSERT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), HasSubstr("STOP by test, and nobody has cleared that since"));
  ASSERT_TRUE(command(CellCommand::kClear).ok());

  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  restart();  // killed
  EXPECT_EQ(state(), CellState::kAborted);
}

// Whatever the end of the program itself broke off.
TEST_F(UnclearedAbort, AnEndInTheMiddleOfAJobIsAnAbort) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  end_and_start_again();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), HasSubstr("the daemon was told to end"));
}

TEST_F(UnclearedAbort, AnEndAtRestIsNone) {
  end_and_start_again();
  EXPECT_EQ(state(), CellState::kStopped);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_EQ(state(), CellState::kIdle);
  runner_->end("the daemon was told to end");
  EXPECT_EQ(laser_.calls.back(), "abort") << "the beam is switched off all the same";
  settle();
  restart();
  EXPECT_EQ(state(), CellState::kStopped);
}

// A head that moves or a beam that is on is not at rest, whatever the state is called.
TEST_F(UnclearedAbort, AnEndWhileTheHeadIsJoggedIsOne) {
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  ASSERT_EQ(state(), CellState::kIdle);
  end_and_start_again();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), HasSubstr("the daemon was told to end"));
}

TEST_F(UnclearedAbort, AnEndWhileABeamIsOnIsOne) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.beam_stays_on = true;
  end_and_start_again();
  EXPECT_EQ(state(), CellState::kAborted);
}

// The program is told to end and does not come to it before somebody goes on with the cell.
TEST_F(UnclearedAbort, AnEndAtRestForgivesNoAbortThatFollows) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  runner_->end("the daemon was told to end");
  settle();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  restart();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), HasSubstr("STOP by test"));
}

// What a full disk does not take of an abort is written once there is room.
TEST_F(UnclearedAbort, ThatAFullDiskDidNotTakeItIsMadeUpFor) {
  {
    const testing::LittleRoom full(0);
    ASSERT_TRUE(command(CellCommand::kAbort).ok());
  }
  restart();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(noted(), ElementsAre("STOP by test"));
}

// And its Clear behind it.
TEST_F(UnclearedAbort, ThatItWasClearedIsWrittenBehindIt) {
  {
    const testing::LittleRoom full(0);
    ASSERT_TRUE(command(CellCommand::kAbort).ok());
    ASSERT_TRUE(command(CellCommand::kClear).ok());
    EXPECT_THAT(noted(), IsEmpty()) << "there is no room";
  }
  settle();
  EXPECT_THAT(noted(), ElementsAre("STOP by test", "cleared by test"));
}

TEST(RecoveryWords, EveryJobThatWasBrokenOffIsNamed) {
  db::Recovery found;
  found.aborted_jobs = {JobId{3}, JobId{5}};
  EXPECT_THAT(recovery_words(found), HasSubstr("in the middle of jobs 3 and 5, and no piece is suspect"));
}

}  // namespace
}  // namespace veneer::daemon
