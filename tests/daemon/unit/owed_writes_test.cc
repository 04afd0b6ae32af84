// Writes that nobody waits for, on a disk that is full for a while: none is lost, or a job would stay `running` for
// good, with every Start, cancel and redo refused.
#include <gmock/gmock.h>

#include "daemon/unit/work_record.h"
#include "tests/daemon/unit/job_runner_fixture.h"
#include "tests/db/unguarded.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;

class OwedWritesTest : public JobRunnerTest {
 protected:
  Status cancel() {
    return database_->call([](Repositories& r) { return r.jobs.cancel(JobId{1}, kThen); });
  }
  void exec(const char* sql) {
    database_->call([sql](Repositories& r) {
      db::exec_unguarded(r.connection.connection(), sql);
      return 0;
    });
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

// Or its row would end the newer work's, and a kill in that would be forgotten.
TEST_F(OwedWritesTest, NoWorkBeginsBeforeAnAbortThatIsOwed) {
  bool full = true;
  database_->owe([&full](Repositories& r) -> Status {
    if (full) return Error{ErrorCode::kStorage, "the disk is full"};
    return r.jobs.note_abort("STOP by test", kThen);
  });
  WorkRecord record(*database_);
  record.forget();
  Status begun = Ok();
  const auto begin = [&] {
    record.begin(WorkRecord::Work::kHoming, "while the laser was homed", [&begun](Status s) { begun = std::move(s); });
    settle();
  };
  begin();
  ASSERT_FALSE(begun.ok());
  EXPECT_THAT(begun.error().message,
              ::testing::HasSubstr("the end of the previous work is not saved yet: the disk is full"));
  record.end(WorkRecord::Work::kHoming);
  full = false;
  begin();
  EXPECT_TRUE(begun.ok());
  const auto owed = [this] {
    return database_->call([](Repositories& r) { return r.jobs.would_owe_clear(); }).value().value_or("");
  };
  EXPECT_EQ(owed(), "STOP by test");
  ASSERT_TRUE(database_->call([](Repositories& r) { return r.jobs.note_cleared("test", kThen); }).ok());
  EXPECT_EQ(owed(), "the program ended while the laser was homed");
}

// Or its row would end the newer work's, and the job that runs again would be stopped under it.
TEST_F(OwedWritesTest, NoWorkBeginsBeforeTheEndOfAJobThatIsOwed) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(job_state(), db::JobState::kRunning);
  bool full = true;
  database_->owe([&full](Repositories&) -> Status {
    return full ? Status(Error{ErrorCode::kStorage, "the disk is full"}) : Ok();
  });
  WorkRecord record(*database_);
  const auto begin = [&] {
    Status begun = Ok();
    record.begin(WorkRecord::Work::kHoming, "while the laser was homed", [&begun](Status s) { begun = std::move(s); });
    settle();
    return begun;
  };
  const auto owed = [this] {
    return database_->call([](Repositories& r) { return r.jobs.would_owe_clear(); }).value().value_or("");
  };
  record.end_job(JobId{1}, "uid 1000");
  const Status early = begin();
  ASSERT_FALSE(early.ok());
  EXPECT_THAT(early.error().message,
              ::testing::HasSubstr("the end of the previous work is not saved yet: the disk is full"));
  EXPECT_EQ(owed(), "the program ended in the middle of job 1");
  record.end(WorkRecord::Work::kHoming);
  full = false;
  ASSERT_TRUE(begin().ok());
  EXPECT_EQ(job_state(), db::JobState::kStopped);
  EXPECT_EQ(owed(), "the program ended while the laser was homed");
}

// Or the next work could not begin, and a start would say that the program ended while this went on.
TEST_F(OwedWritesTest, AnEndOfAJobThatIsRefusedForGoodEndsTheWorkForItAllTheSame) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(job_state(), db::JobState::kRunning);
  exec("CREATE TEMP TRIGGER refused BEFORE UPDATE OF state ON jobs BEGIN SELECT RAISE(ABORT, 'refused'); END");
  WorkRecord(*database_).end_job(JobId{1}, "uid 1000");
  EXPECT_EQ(job_state(), db::JobState::kRunning) << "nothing refused it";
  const int under_way = database_->call([](Repositories& r) {
    return r.connection.connection().execAndGet("SELECT under_way FROM activities ORDER BY id DESC LIMIT 1").getInt();
  });
  EXPECT_EQ(under_way, 0);
}

TEST_F(OwedWritesTest, AnEndOfAJobThatIsTriedAgainLeavesOtherWorkOnRecordOnce) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(job_state(), db::JobState::kRunning);
  const auto noted = [this] {
    return database_->call([](Repositories& r) {
      return r.connection.connection()
          .execAndGet("SELECT count(*) FROM activities WHERE doing = 'while the head was jogged'")
          .getInt();
    });
  };
  WorkRecord record(*database_);
  record.begin(WorkRecord::Work::kJog, "while the head was jogged", [](const Status& s) { ASSERT_TRUE(s.ok()); });
  settle();
  // No constraint: it is tried again.
  exec("CREATE TEMP TRIGGER busy BEFORE UPDATE OF state ON jobs BEGIN SELECT json('{'); END");
  record.end_job(JobId{1}, "uid 1000");
  noted(), noted();
  EXPECT_EQ(noted(), 1);
  exec("DROP TRIGGER busy");
  EXPECT_EQ(noted(), 2);
  EXPECT_EQ(job_state(), db::JobState::kStopped);
}

// Whoever writes the end of a job after newer work was begun lets that stand.
TEST_F(OwedWritesTest, AnEndThatComesLateLeavesNewerWorkUnderWay) {
  WorkRecord record(*database_);
  const auto begin = [&](const std::string& doing) {
    record.begin(WorkRecord::Work::kJob, doing, [](const Status& begun) { ASSERT_TRUE(begun.ok()); });
    settle();
  };
  begin("in the middle of job 1");
  const WorkRecord::End first = record.end_all_with();
  EXPECT_TRUE(database_->call([&](Repositories&) { return first.rests(); }));
  begin("in the middle of job 2");
  EXPECT_FALSE(database_->call([&](Repositories&) { return first.rests(); }));
  database_->call([&](Repositories&) { return first.written(), 0; });
  const WorkRecord::End second = record.end_all_with();
  EXPECT_TRUE(database_->call([&](Repositories&) { return second.rests(); }));
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
  tell(CellCommand::kUnsuspend);
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
