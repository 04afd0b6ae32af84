// Writes that nobody waits for, on a disk that is full for a while: none is lost, or a job would stay `running` for
// good, with every Start, cancel and redo refused.
#include <gmock/gmock.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;

class OwedWritesTest : public JobRunnerTest {
 protected:
  Status cancel() {
    return database_->call([](Repositories& r) { return r.jobs.cancel(JobId{1}, kThen); });
  }
};

TEST_F(OwedWritesTest, AreTriedBeforeWhateverIsAskedNextUntilTheyAreWritten) {
  std::vector<int> done;
  int refusals = 2;
  const auto write = [&](int number) {
    database_->owe([&done, &refusals, number](Repositories&) -> Status {
      if (refusals-- > 0) return Error{ErrorCode::kStorage, "the disk is full"};
      done.push_back(number);
      return number == 2 ? Status(Error{ErrorCode::kConflict, "it was done before"}) : Ok();
    });
  };
  write(1);
  write(2);
  EXPECT_THAT(database_->call([&](Repositories&) { return done; }), ElementsAre(1, 2));
  EXPECT_THAT(database_->call([&](Repositories&) { return done; }), ElementsAre(1, 2)) << "once, and no more";
}

TEST_F(OwedWritesTest, AJobThatWasStoppedBetweenTwoPanelsUnderAFullDiskIsStopped) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended) << "for the second panel";
  {
    const testing::LittleRoom full(0);
    ASSERT_TRUE(command(CellCommand::kStop).ok());
  }
  EXPECT_EQ(job_state(), db::JobState::kStopped);
  EXPECT_TRUE(cancel().ok());
}

TEST_F(OwedWritesTest, AJobThatWasBrokenOffBetweenTwoPanelsUnderAFullDiskIsAborted) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  {
    const testing::LittleRoom full(0);
    runner_->abort("STOP");
    settle();
    EXPECT_EQ(state(), CellState::kAborted);
  }
  EXPECT_EQ(job_state(), db::JobState::kAborted);
  EXPECT_TRUE(cancel().ok());
}

// STOP comes while the run's first row is on its way to the disk.
TEST_F(OwedWritesTest, ARunThatWasBrokenOffBeforeItsFirstPieceUnderAFullDiskEnds) {
  load_first_panel();
  runner_->command(CellCommand::kUnsuspend, "test", [](const Status&) {});
  // After each turn whatever it asked of the database is done, and its answer waits for a later turn.
  while (!*database_->call([](Repositories& r) { return r.jobs.last_run(); })) turn();
  {
    const testing::LittleRoom full(0);
    runner_->abort("STOP");
    settle();
  }
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_EQ(job_state(), db::JobState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

}  // namespace
}  // namespace veneer::daemon
