// What the audit log keeps of many STOPs, which need no login: all of them as long as the database keeps up, else their
// number. STOP itself waits for none of it.
#include <gmock/gmock.h>

#include "db/events.h"
#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class StopAuditTest : public JobRunnerTest {
 protected:
  void press_stop(int times) {
    for (int i = 0; i < times; ++i)
      tell(
          CellCommand::kAbort, [this](const Status& taken) { answered_ += taken ? 1 : 0; }, "anonymous");
  }
  std::vector<db::AuditEntry> noted() {
    return *database_->call([](Repositories& r) { return r.audit.latest(10'000); });
  }
  // What became of the job, and what broke the cell's work off: "job stopped by anna".
  std::vector<std::string> happened() {
    settle();
    std::vector<std::string> out;
    const auto events = database_->call([](Repositories& r) { return db::Events(r.connection).read({}, {}, 1000); });
    for (const db::EventRecord& event : *events)
      if ((event.kind == "job" && event.part == 1 && event.what != "running") ||
          (event.kind == "cell" && event.part == 1))
        out.push_back(event.kind + " " + event.what + " by " + event.who);
    return out;
  }
  void load_and_cut() {
    laser_.burn_at_once = false;
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_EQ(state(), CellState::kExecute);
  }
  void say(CellCommand command, const std::string& who) {
    tell(
        command, [](const Status& taken) { EXPECT_TRUE(taken.ok()) << taken.error().message; }, who);
    settle();
  }
  // Anna gives the word when all of the run is ready but its row in the database.
  void give_while_a_run_is_written(CellCommand word) {
    load_first_panel();
    const SlowDatabase slow(*database_);
    tell(CellCommand::kUnsuspend);
    for (int i = 0; i < 20; ++i) poll();
    ASSERT_EQ(state(), CellState::kUnsuspending);
    tell(
        word, [](const Status& taken) { EXPECT_TRUE(taken.ok()) << taken.error().message; }, "anna");
    poll();
  }
  std::ptrdiff_t aborts() const { return std::count(laser_.calls.begin(), laser_.calls.end(), "abort"); }
  int answered_ = 0;
};

TEST_F(StopAuditTest, EachIsNotedAsLongAsTheDatabaseKeepsUp) {
  for (int i = 0; i < 100; ++i) {
    press_stop(1);
    settle();
  }
  EXPECT_EQ(noted().size(), 100U);
}

TEST_F(StopAuditTest, AFloodWaitsWithinBoundsIsCountedAndDelaysNoStop) {
  {
    const SlowDatabase slow(*database_);
    press_stop(1000);
    poll();
    EXPECT_EQ(answered_, 1000);
    EXPECT_EQ(aborts(), 1000) << "every one of them reaches the laser";
    EXPECT_EQ(state(), CellState::kAborted);
  }
  settle();
  const auto rows = noted();
  ASSERT_EQ(rows.size(), 65U);
  EXPECT_EQ(rows.back().what, "cell.abort");
  EXPECT_EQ(rows.back().who, "anonymous");
  EXPECT_THAT(rows.front().detail, HasSubstr("936 more"));
}

TEST_F(StopAuditTest, WhatAFullDiskDidNotTakeIsNotedOnceItTakesSomething) {
  {
    const testing::LittleRoom full(0);
    press_stop(2);
    settle();
    EXPECT_EQ(aborts(), 2);
    EXPECT_EQ(noted().size(), 0U);
  }
  press_stop(1);
  settle();
  EXPECT_EQ(noted().size(), 3U);
}

TEST_F(StopAuditTest, WhatOperatorsDoIsNotedBesideAFlood) {
  {
    const SlowDatabase slow(*database_);
    press_stop(1000);
    tell(
        CellCommand::kClear, [](const Status&) {}, "uid 1000");
    poll();
  }
  settle();
  const auto rows = noted();
  EXPECT_EQ(std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row.what == "cell.clear"; }), 1);
}

// Pieces are booked behind what waits: no program that went wild may make a run wait for the disk.
TEST_F(StopAuditTest, AnOperatorsFloodWaitsWithinBoundsToo) {
  AuditLog log(*database_, make_null_logger());
  {
    const SlowDatabase slow(*database_);
    EXPECT_TRUE(log.has_room("uid 1000"));
    for (int i = 0; i < 1000; ++i) log.write({0, "2026-05-01T00:00:00.000Z", "uid 1000", "api.laserJog", {}});
    EXPECT_FALSE(log.has_room("uid 1000"));
    EXPECT_TRUE(log.has_room("uid 1001"));
    log.write({0, "2026-05-01T00:00:00.000Z", "uid 1001", "api.laserJog", {}});
  }
  settle();
  EXPECT_TRUE(log.has_room("uid 1000"));
  const auto rows = noted();
  EXPECT_EQ(std::ranges::count(rows, "uid 1001", &db::AuditEntry::who), 1);
  EXPECT_EQ(rows.size(), AuditLog::kMostOfOne + AuditLog::kMostWaiting + 2);
  EXPECT_THAT(rows.front().detail, HasSubstr("872 more"));
}

// ---- whose stop it was ----------------------------------------------------------------------------------------------

TEST_F(StopAuditTest, WhoStopsBetweenTwoPiecesStandsWithTheJob) {
  load_and_cut();
  say(CellCommand::kStop, "anna");
  laser_.finish();
  EXPECT_THAT(happened(), ElementsAre("job stopped by anna"));
}

TEST_F(StopAuditTest, WhoAskedFirstToStopAfterAPieceStoppedTheJob) {
  load_and_cut();
  runner_->stop_after_piece("anna", [](const Status& taken) { EXPECT_TRUE(taken.ok()); });
  runner_->stop_after_piece("bert", [](const Status& taken) { EXPECT_TRUE(taken.ok()); });
  laser_.finish();
  EXPECT_THAT(happened(), ElementsAre("job stopped by anna"));
}

TEST_F(StopAuditTest, WhoStopsAJobThatWaitsForItsNextPanelStandsWithIt) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended) << "for the second panel";
  say(CellCommand::kStop, "anna");
  EXPECT_THAT(happened(), ElementsAre("job stopped by anna"));
}

TEST_F(StopAuditTest, NobodyStoppedAJobThatWasCutToItsEndAllTheSame) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002"), look();
  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  say(CellCommand::kStop, "anna");
  laser_.finish();
  EXPECT_THAT(happened(), ElementsAre("job complete by "));
}

TEST_F(StopAuditTest, WhoPressesStopStandsWithTheJobAndTheCell) {
  load_and_cut();
  say(CellCommand::kAbort, "anna");
  say(CellCommand::kClear, "bert");
  EXPECT_THAT(happened(), UnorderedElementsAre("cell STOP by anna; piece A1-1 is suspect by anna",
                                               "job aborted by anna", "cell cleared by bert"));
}

TEST_F(StopAuditTest, WhoPressesStopWhileAJobWaitsStandsWithIt) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended);
  say(CellCommand::kAbort, "anna");
  EXPECT_THAT(happened(), UnorderedElementsAre("cell STOP by anna by anna", "job aborted by anna"));
}

TEST_F(StopAuditTest, WhoStopsAHeldPieceBrokeTheJobOff) {
  load_and_cut();
  say(CellCommand::kHold, "bert");
  say(CellCommand::kStop, "anna");
  EXPECT_THAT(happened(), UnorderedElementsAre("cell stopped by the operator; piece A1-1 is suspect by anna",
                                               "job aborted by anna"));
}

TEST_F(StopAuditTest, NobodyStoppedWhatTheLaserBrokeOff) {
  load_and_cut();
  laser_.fail({ErrorCode::kDisconnected, "the link was lost"});
  const auto told = happened();
  EXPECT_THAT(told, ::testing::Contains("job aborted by "));
  EXPECT_THAT(told, ::testing::Contains(AllOf(HasSubstr("the link was lost"), EndsWith("by veneerd"))));
}

// It was not in the database yet when the word was given.
TEST_F(StopAuditTest, WhoPressesStopWhileARunIsBeingWrittenStandsWithTheJob) {
  give_while_a_run_is_written(CellCommand::kAbort);
  EXPECT_THAT(happened(), UnorderedElementsAre("cell STOP by anna by anna", "job aborted by anna"));
}

TEST_F(StopAuditTest, WhoStopsARunThatIsBeingWrittenStandsWithTheJob) {
  give_while_a_run_is_written(CellCommand::kStop);
  EXPECT_THAT(happened(), UnorderedElementsAre("cell stopped by the operator by anna", "job aborted by anna"));
}

}  // namespace
}  // namespace veneer::daemon
