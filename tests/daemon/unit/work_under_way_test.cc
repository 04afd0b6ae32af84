// A kill in the middle of work that is no run: the next start is Aborted, and says what was being done. Nothing of it
// begins before that is on the disk.
#include <gmock/gmock.h>

#include <type_traits>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// All that an activity has to do, but for one thing that nobody would miss before it is too late.
class Forgetful : public Activity {
 public:
  bool needs_look() const override { return false; }
  void look(Reply reply) override { reply(Ok()); }
  std::optional<Point<MachineFrame>> next_start() const override { return std::nullopt; }
  void go_on() override {}
  void burnt(const std::string&) override {}
};
struct Recorded : virtual Forgetful {
  std::string recorded() const override { return "while nothing was done"; }
};
struct BrokenOff : virtual Forgetful {
  std::optional<BrokenRun> broken_off(const std::string&, std::string&) override { return std::nullopt; }
};
struct ProvesPose : virtual Forgetful {
  bool proves_pose() const override { return true; }
};
struct EndsUnproven : virtual Forgetful {
  bool ends_unproven() const override { return true; }
};
// What says these, and nothing else.
template <class... Said>
struct Says : Said... {};

TEST(AnActivity, CannotForgetItsRecordNorItsProofsNorWhatItsEndLeaves) {
  EXPECT_FALSE((std::is_abstract_v<Says<Recorded, BrokenOff, ProvesPose, EndsUnproven>>)) << "it has said it all";
  EXPECT_TRUE((std::is_abstract_v<Says<BrokenOff, ProvesPose, EndsUnproven>>)) << "its record is forgotten";
  EXPECT_TRUE((std::is_abstract_v<Says<Recorded, ProvesPose, EndsUnproven>>)) << "what its end leaves is forgotten";
  EXPECT_TRUE((std::is_abstract_v<Says<Recorded, BrokenOff, EndsUnproven>>)) << "the looks again are forgotten";
  EXPECT_TRUE((std::is_abstract_v<Says<Recorded, BrokenOff, ProvesPose>>)) << "the last look is forgotten";
}

class WorkUnderWay : public JobRunnerTest {
 protected:
  void SetUp() override {
    JobRunnerTest::SetUp();
    laser_.can_jog = true;
  }
  Status burn_pattern(double power) {
    Stroke stroke;
    stroke.role = StrokeRole::kPattern;
    stroke.path = {point<MachineFrame>(10, 10), point<MachineFrame>(50, 10)};
    stroke.speed = MmPerSecond(10);
    stroke.power = PowerFraction(power);
    const auto out = std::make_shared<Status>();
    burn_wanted(LaserJob{{stroke}}, [out](Status s) { *out = std::move(s); });
    settle();
    return *out;
  }
  // Idle, with the first panel cut, on which pieces may be cut again.
  void cut_first_panel() {
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_TRUE(command(CellCommand::kStop).ok());
    ASSERT_TRUE(command(CellCommand::kReset).ok());
  }
  void complete_job() {
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    bed_.lay("P-0002");
    look();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_EQ(state(), CellState::kComplete);
  }
  void expect_aborted(const std::string& what) {
    restart();
    EXPECT_EQ(state(), CellState::kAborted);
    EXPECT_THAT(reason(), AllOf(HasSubstr(what), HasSubstr("Clear and Reset")));
    restart();
    EXPECT_EQ(state(), CellState::kAborted) << "nobody has cleared it";
    ASSERT_TRUE(command(CellCommand::kClear).ok());
    restart();
    EXPECT_EQ(state(), CellState::kStopped);
  }
  // Turn by turn, for what runs after it is not to run.
  bool job_becomes(db::JobState wanted) {
    constexpr int kMostTurns = 1000;
    for (int i = 0; i < kMostTurns && job_state() != wanted; ++i) turn();
    return job_state() == wanted;
  }
  void expect_stopped() {
    restart();
    EXPECT_EQ(state(), CellState::kStopped) << reason();
  }
};

TEST_F(WorkUnderWay, KilledWhileTheLaserIsHomed) {
  laser_.homes = false;
  tell(CellCommand::kReset);
  settle();
  ASSERT_EQ(laser_.calls.back(), "home");
  expect_aborted("the program ended while the laser was homed");
}

TEST_F(WorkUnderWay, KilledWhileTheHeadIsJogged) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  expect_aborted("the program ended while the head was jogged");
}

TEST_F(WorkUnderWay, KilledWhileAPatternIsBurnt) {
  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  static_cast<void>(burn_pattern(0.2));
  ASSERT_TRUE(laser_.burning());
  expect_aborted("the program ended while a pattern was burnt");
}

TEST_F(WorkUnderWay, KilledWhilePiecesAreCutAgain) {
  cut_first_panel();
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1"}).ok());
  ASSERT_TRUE(laser_.burning());
  expect_aborted("the program ended while pieces of job 1 were cut again");
}

TEST_F(WorkUnderWay, KilledWhileAFrameIsTraced) {
  load_first_panel();
  laser_.burn_at_once = false;
  static_cast<void>(frame());
  ASSERT_TRUE(laser_.burning());
  expect_aborted("the program ended while the frame of panel P-0001 was traced");
}

// Hands lay a panel, and the head may be sent out of the picture.
TEST_F(WorkUnderWay, KilledWhileAJobWaitsForItsFirstPanel) {
  load_first_panel();
  expect_aborted("the program ended in the middle of job 1");
  EXPECT_EQ(job_state(), db::JobState::kPlanned) << "nothing of it was cut";
}

TEST_F(WorkUnderWay, KilledWhileAJobIsPreparedOrWaitsForItAgain) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  runner_->start_job(JobId{1}, "test", [](const Status&) {});
  ASSERT_EQ(state(), CellState::kStarting);
  database_->call([](Repositories&) { return 0; });
  expect_aborted("in the middle of job 1");

  load_first_panel();
  ASSERT_TRUE(frame().ok());
  expect_aborted("the program ended in the middle of job 1");
}

TEST_F(WorkUnderWay, KilledInAJobItNamesTheJobAndItsPieces) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  expect_aborted("the cell stopped in the middle of job 1, and one piece is suspect");
}

// The last piece is booked, and the camera has yet to see where it was cut.
TEST_F(WorkUnderWay, KilledBeforeACompleteJobHasComeToItsEnd) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.finish();
  while (piece_states().back() != P::kCut) turn();
  ASSERT_NE(state(), CellState::kComplete);
  expect_aborted("in the middle of job 1");
  EXPECT_EQ(job_state(), db::JobState::kComplete);
}

TEST_F(WorkUnderWay, WhatCameToItsEndIsNoAbort) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  expect_stopped();

  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(jog(20).ok());
  ASSERT_TRUE(jog(-20).ok());
  laser_.end_jog();
  laser_.end_jog();
  settle();
  expect_stopped();

  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(burn_pattern(0.2).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  expect_stopped();

  cut_first_panel();
  ASSERT_TRUE(recut({"A1-1"}).ok());
  ASSERT_EQ(state(), CellState::kIdle);
  expect_stopped();

  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  expect_stopped();
}

TEST_F(WorkUnderWay, NorIsAJobThatIsComplete) {
  complete_job();
  expect_stopped();
}

// Nothing of the runner runs after the write that ends the job.
TEST_F(WorkUnderWay, KilledRightAfterAJobWasWrittenToBeCompleteItEndedWell) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  tell(CellCommand::kUnsuspend);
  ASSERT_TRUE(job_becomes(db::JobState::kComplete));
  ASSERT_NE(state(), CellState::kComplete);
  expect_stopped();
  EXPECT_EQ(job_state(), db::JobState::kComplete);
}

TEST_F(WorkUnderWay, NorIsOneThatWasStoppedAfterAPiece) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  laser_.finish();
  ASSERT_TRUE(job_becomes(db::JobState::kStopped));
  ASSERT_NE(state(), CellState::kStopped);
  expect_stopped();
  EXPECT_EQ(job_state(), db::JobState::kStopped);
}

TEST_F(WorkUnderWay, NorOneThatWasStoppedWhileItWaitedForAPanel) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended);
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  expect_stopped();
  EXPECT_EQ(job_state(), db::JobState::kStopped);
}

TEST_F(WorkUnderWay, WhatWasRefusedAfterAllIsNone) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  runner_->start_job(JobId{99}, "test", [](const Status&) {});
  settle();
  ASSERT_EQ(state(), CellState::kIdle);
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  EXPECT_FALSE(burn_pattern(0.2).ok());
  laser_.can_jog = false;
  EXPECT_FALSE(jog(20).ok());
  expect_stopped();
}

TEST_F(WorkUnderWay, AStopThatWasClearedLeavesNoneBehind) {
  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  static_cast<void>(burn_pattern(0.2));
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  expect_stopped();
}

// ---- the record comes first -----------------------------------------------------------------------------------------

TEST_F(WorkUnderWay, NothingBeginsThatAFullDiskKeepsNoRecordOf) {
  cut_first_panel();
  const auto calls = laser_.calls;
  {
    const testing::LittleRoom full(0);
    for (const Status& begun : {jog(20), burn_pattern(0.2), recut({"A1-1"}), start()}) {
      ASSERT_FALSE(begun.ok());
      EXPECT_THAT(begun.error().message, HasSubstr("make room on the disk"));
      EXPECT_EQ(state(), CellState::kIdle);
    }
    EXPECT_EQ(laser_.calls, calls) << "nothing was sent to the laser";
    ASSERT_TRUE(command(CellCommand::kStop).ok());
    EXPECT_THAT(command(CellCommand::kReset).error().message,
                AllOf(HasSubstr("the laser is not homed"), HasSubstr("make room on the disk")));
    EXPECT_EQ(state(), CellState::kStopped);
    EXPECT_EQ(laser_.calls, calls);
  }
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_TRUE(burn_pattern(0.2).ok()) << "with room again";
}

TEST_F(WorkUnderWay, AFrameIsNotTracedEither) {
  load_first_panel();
  {
    const testing::LittleRoom full(0);
    EXPECT_THAT(frame().error().message, HasSubstr("make room on the disk"));
    EXPECT_EQ(state(), CellState::kSuspended);
    EXPECT_EQ(starts(), 0);
  }
  EXPECT_TRUE(frame().ok());
}

// Neither waits for the disk, and what was to begin does not.
TEST_F(WorkUnderWay, StopAndHoldComeBeforeTheRecord) {
  cut_first_panel();
  {
    const SlowDatabase slow(*database_);
    runner_->recut({"A1-1"}, {}, "test", [](const Status&) {});
    poll();
    bool held = false;
    tell(CellCommand::kHold, [&](const Status& s) { held = s.ok(); });
    EXPECT_TRUE(held);
    EXPECT_EQ(state(), CellState::kIdle);
    runner_->recut({"A1-1"}, {}, "test", [](const Status&) {});
    tell(CellCommand::kAbort);
    EXPECT_EQ(laser_.calls.back(), "abort");
    poll();
  }
  const auto before = starts();
  settle();
  EXPECT_EQ(starts(), before);
  EXPECT_EQ(state(), CellState::kAborted);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  expect_stopped();
}

TEST_F(WorkUnderWay, AJogThatWasAskedForBeforeAStopDoesNotFollowIt) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  {
    const SlowDatabase slow(*database_);
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test", [](const Status&) {});
    poll();
    tell(CellCommand::kAbort);
    poll();
  }
  settle();
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
  EXPECT_EQ(state(), CellState::kAborted);
}

TEST_F(WorkUnderWay, NorOneThatWasStoppedBeforeItMoved) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  Status taken = Ok();
  {
    const SlowDatabase slow(*database_);
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test",
                           [&](const Status& s) { taken = s; });
    poll();
    runner_->jogging().stop();
    poll();
  }
  settle();
  EXPECT_EQ(taken.error().message, "the head was stopped before it moved");
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
  expect_stopped();
}

// Hands may be in it: what was said before the lid was opened moves nothing once the disk has taken the record.
TEST_F(WorkUnderWay, ALidThatIsOpenedMeanwhileTakesTheWordBack) {
  const auto lid_moves = [this] {
    poll();
    laser_.open_lid();
    laser_.close_lid();
    poll();
  };
  Status told = Ok();
  const auto note = [&told](const Status& s) { told = s; };
  {
    const SlowDatabase slow(*database_);
    tell(CellCommand::kReset, note);
    lid_moves();
  }
  settle();
  EXPECT_THAT(told.error().message, HasSubstr("the laser is not homed: the lid was opened since"));
  EXPECT_THAT(laser_.calls, Not(Contains("home")));
  EXPECT_EQ(state(), CellState::kStopped);
  laser_.lid_was_open = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  {
    const SlowDatabase slow(*database_);
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test", note);
    lid_moves();
  }
  settle();
  EXPECT_THAT(told.error().message, HasSubstr("the lid was opened since"));
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
  laser_.lid_was_open = false;
  {
    const SlowDatabase slow(*database_);
    Stroke dark;
    dark.role = StrokeRole::kPattern;
    dark.path = {point<MachineFrame>(10, 10), point<MachineFrame>(50, 10)};
    dark.speed = MmPerSecond(10);
    burn_wanted(LaserJob{{dark}}, note);
    lid_moves();
  }
  settle();
  EXPECT_THAT(told.error().message, HasSubstr("the lid was opened since"));
  EXPECT_EQ(starts(), 0);
  EXPECT_EQ(state(), CellState::kIdle);
}

// The first is refused when the second is on its way already.
TEST_F(WorkUnderWay, EachOfSeveralJogsIsOnRecord) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  {
    const SlowDatabase slow(*database_);
    laser_.can_jog = false;
    const auto drop = [](const Status&) {};
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test",
                           [&](const Status&) { laser_.can_jog = true; });
    runner_->jogging().jog(Millimetres(20), Millimetres(0), MmPerSecond(50), "test", drop);
  }
  settle();
  ASSERT_EQ(laser_.calls.back(), "jog");
  expect_aborted("while the head was jogged");
}

}  // namespace
}  // namespace veneer::daemon
