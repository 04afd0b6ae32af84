// What the audit log keeps of many STOPs, which need no login: all of them as long as the database keeps up, else their
// number. STOP itself waits for none of it.
#include <gmock/gmock.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace veneer::daemon
