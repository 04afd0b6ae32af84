// The head sent by hand, without a unit around it: what calls off a jog that has not moved yet, and when it is on
// record.
#include "daemon/unit/jogging.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "tests/support/sim_laser.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A simulated laser without switches, which may not know where its corner is.
class CornerLaser final : public LaserDriver {
 public:
  explicit CornerLaser(tests::SimLaser& laser) : laser_(laser) {}
  void connect(OnEvent on_event) override { laser_.connect(std::move(on_event)); }
  void home() override { laser_.home(); }
  void start(LaserJob job) override { laser_.start(std::move(job)); }
  void hold() override { laser_.hold(); }
  void resume() override { laser_.resume(); }
  void stop_after_piece() override { laser_.stop_after_piece(); }
  void abort() noexcept override { laser_.abort(); }
  LaserStatus status() const override {
    LaserStatus status = laser_.status();
    status.homed = status.homed && knows_corner;
    return status;
  }
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override { return laser_.jog(dx, dy, speed); }
  void stop_jog() override { laser_.stop_jog(); }
  Status corner_is_here() override {
    ++corners;
    return Ok();
  }

  bool knows_corner = true;
  int corners = 0;  // told

 private:
  tests::SimLaser& laser_;
};

class JoggingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(dir_.path() / "test.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    record_.emplace(*database_);
    audit_.emplace(*database_, make_null_logger());
    jogging_.emplace(Jogging::Unit{corner_laser_, limits_, view_, keep_out_, activities_, *record_, *audit_,
                                   [this] { ++times_head_moves_; }});
    laser_.connect([this](const LaserEvent& event) {
      if (std::holds_alternative<laser_event::JogEnded>(event) && jogging_) jogging_->ended();
    });
    laser_.calls.clear();
    laser_.can_jog = true;
    limits_.travel.add(point<MachineFrame>(0, 0));
    limits_.travel.add(point<MachineFrame>(520, 380));
    view_.state = CellState::kIdle;
  }
  void TearDown() override {
    jogging_.reset();
    audit_.reset();
    database_.reset();
  }

  // What the database's thread was asked before is done, and told.
  void settle() {
    for (int i = 0; i < 20; ++i) {
      database_->call([](Repositories&) { return 0; });
      io_.restart();
      if (io_.poll() == 0 && i > 2) return;
    }
    FAIL() << "the reactor does not come to rest";
  }
  void ask(double dx, double dy = 0) {
    told_.reset();
    jogging_->jog(Millimetres(dx), Millimetres(dy), MmPerSecond(50), "uid 1000", [this](Status s) { told_ = s; });
  }
  Status jog(double dx, double dy = 0) {
    ask(dx, dy);
    settle();
    return told_ ? *told_ : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  // A jog that is asked for, and whose way to the disk lets `meanwhile` happen.
  Status jog_while(const std::function<void()>& meanwhile) {
    ask(20);
    EXPECT_TRUE(jogging_->coming());
    meanwhile();
    settle();
    EXPECT_FALSE(jogging_->coming());
    return told_ ? *told_ : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  void expect_never_moved() {
    EXPECT_THAT(laser_.calls, Not(Contains("jog")));
    EXPECT_FALSE(jogging_->under_way());
    EXPECT_FALSE(record_->any());
  }

  boost::asio::io_context io_;
  veneer::testing::TempDirectory dir_;
  std::unique_ptr<DatabaseThread> database_;
  tests::SimLaser laser_{io_};
  CornerLaser corner_laser_{laser_};
  LaserLimits limits_;
  CellView view_;
  std::vector<KeepOut> keep_out_;
  Epoch activities_;
  std::optional<WorkRecord> record_;
  std::optional<AuditLog> audit_;
  std::optional<Jogging> jogging_;
  int times_head_moves_ = 0;
  std::optional<Status> told_;
};

TEST_F(JoggingTest, IsTakenWhileTheCellIsIdleOrCompleteAndElsewhereLeavesNoTrace) {
  for (const CellState state :
       {CellState::kStopped, CellState::kResetting, CellState::kStarting, CellState::kExecute, CellState::kHolding,
        CellState::kHeld, CellState::kUnholding, CellState::kSuspending, CellState::kSuspended,
        CellState::kUnsuspending, CellState::kCompleting, CellState::kStopping, CellState::kAborting,
        CellState::kAborted, CellState::kClearing}) {
    view_.state = state;
    const Status refused = jog(20);
    ASSERT_FALSE(refused.ok()) << to_string(state);
    EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
    EXPECT_THAT(refused.error().message, HasSubstr(std::string("now it is ") + std::string(to_string(state))));
    EXPECT_FALSE(record_->any());
  }
  EXPECT_THAT(laser_.calls, IsEmpty());
  EXPECT_EQ(times_head_moves_, 0);
  for (const CellState state : {CellState::kIdle, CellState::kComplete}) {
    view_.state = state;
    EXPECT_TRUE(jog(20).ok()) << to_string(state);
  }
}

constexpr CellState kInMotion[] = {CellState::kResetting,  CellState::kStarting,  CellState::kExecute,
                                   CellState::kHolding,    CellState::kHeld,      CellState::kUnholding,
                                   CellState::kSuspending, CellState::kSuspended, CellState::kUnsuspending,
                                   CellState::kCompleting, CellState::kStopping,  CellState::kAborting,
                                   CellState::kClearing};

// A machine without switches whose controller has forgotten its corner: Reset only asks for it, and leaves Aborted.
TEST_F(JoggingTest, ALaserThatLostItsCornerIsBroughtThereWhileStoppedOrAborted) {
  limits_.finds_home = false;
  corner_laser_.knows_corner = false;
  for (const CellState state : {CellState::kStopped, CellState::kAborted, CellState::kIdle}) {
    view_.state = state;
    EXPECT_TRUE(jog(-30).ok()) << to_string(state);
    laser_.end_jog();
    settle();
    EXPECT_FALSE(record_->any());
    EXPECT_TRUE(jogging_->corner_is_here().ok()) << to_string(state);
  }
  laser_.calls.clear();
  for (const CellState state : kInMotion) {
    view_.state = state;
    EXPECT_FALSE(jog(-30).ok()) << to_string(state);
  }
  view_.state = CellState::kAborted;
  corner_laser_.knows_corner = true;
  EXPECT_FALSE(jog(-30).ok()) << "it knows its corner: Reset brings it back";
  corner_laser_.knows_corner = false, limits_.finds_home = true;
  EXPECT_FALSE(jog(-30).ok()) << "Reset finds its corner";
  limits_.finds_home = laser_.present = false;
  laser_.connect([](const LaserEvent&) {});
  EXPECT_FALSE(jog(-30).ok()) << "it is not connected";
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
}

// A pattern is looked at in Starting: it was held against travel and zones from the corner that was.
TEST_F(JoggingTest, TheCornerIsToldAtRestOnly) {
  for (const CellState state : kInMotion) {
    view_.state = state;
    const Status refused = jogging_->corner_is_here();
    ASSERT_FALSE(refused.ok()) << to_string(state);
    EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
    EXPECT_THAT(refused.error().message, HasSubstr(std::string("now it is ") + std::string(to_string(state))));
  }
  EXPECT_EQ(corner_laser_.corners, 0);
  for (const CellState state : {CellState::kIdle, CellState::kComplete, CellState::kStopped, CellState::kAborted}) {
    view_.state = state;
    EXPECT_TRUE(jogging_->corner_is_here().ok()) << to_string(state);
  }
  EXPECT_EQ(corner_laser_.corners, 4);
}

TEST_F(JoggingTest, IsOnRecordBeforeTheHeadMovesAndUntilTheLaserTellsItsEnd) {
  ask(20);
  EXPECT_TRUE(record_->any());
  EXPECT_THAT(laser_.calls, Not(Contains("jog"))) << "the disk has it first";
  EXPECT_FALSE(told_) << "and is waited for";
  settle();
  ASSERT_TRUE(told_ && told_->ok());
  EXPECT_THAT(laser_.calls, Contains("jog"));
  EXPECT_TRUE(jogging_->under_way());
  EXPECT_TRUE(record_->any());
  laser_.end_jog();
  settle();
  EXPECT_FALSE(jogging_->under_way());
  EXPECT_FALSE(record_->any());
}

TEST_F(JoggingTest, WhoeverLooksAtTheBedIsToldWhenItIsAskedForAndWhenItMoves) {
  ask(20);
  EXPECT_EQ(times_head_moves_, 1);
  settle();
  EXPECT_EQ(times_head_moves_, 2);
}

TEST_F(JoggingTest, AStopCallsOffWhatIsComingAndReachesTheLaserAtOnce) {
  const Status stopped = jog_while([this] {
    jogging_->stop();
    EXPECT_THAT(laser_.calls, Contains("stop_jog"));
  });
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  expect_never_moved();
  EXPECT_TRUE(jog(20).ok()) << "the next is none of its business";
}

TEST_F(JoggingTest, SoDoesTheEndOfAnActivity) {
  const Status over = jog_while([this] { activities_.end(); });
  ASSERT_FALSE(over.ok());
  EXPECT_EQ(over.error().code, ErrorCode::kCancelled);
  expect_never_moved();
}

TEST_F(JoggingTest, SoDoesALidThatIsClosedAgain) {
  const Status opened = jog_while([this] { laser_.open_and_close_lid(); });
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kRefused);
  EXPECT_THAT(opened.error().message, HasSubstr("the lid was opened"));
  expect_never_moved();
}

TEST_F(JoggingTest, SoDoesAStateThatOthersBegan) {
  const Status elsewhere = jog_while([this] { view_.state = CellState::kStarting; });
  ASSERT_FALSE(elsewhere.ok());
  EXPECT_EQ(elsewhere.error().code, ErrorCode::kConflict);
  expect_never_moved();
}

TEST_F(JoggingTest, ALaserThatRefusesItLeavesNothingOnRecord) {
  laser_.can_jog = false;
  EXPECT_FALSE(jog(20).ok());
  expect_never_moved();
}

TEST_F(JoggingTest, ZonesCountOnlyForALaserThatKnowsWhereItStands) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(16, 0));
  clamp.add(point<MachineFrame>(18, 40));
  keep_out_ = {{"clamp", clamp}};
  EXPECT_THAT(jog(30).error().message, HasSubstr("the zone \"clamp\" lies in that way"));
  expect_never_moved();
  laser_.present = false;
  laser_.connect([](const LaserEvent&) {});
  ASSERT_FALSE(laser_.status().homed);
  EXPECT_TRUE(jog(30).ok());
}

// The first is refused when the second is on its way to the disk already.
TEST_F(JoggingTest, OneRecordStandsForSeveralUntilTheLastHasEnded) {
  ask(20);
  ask(20);
  settle();
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "jog"), 2);
  EXPECT_TRUE(record_->any());
  ask(20);
  jogging_->ended();
  EXPECT_TRUE(record_->any()) << "one is coming";
  settle();
  laser_.end_jog();
  settle();
  EXPECT_FALSE(record_->any());
}

TEST_F(JoggingTest, AHeadThatSomebodyElseSentIsUnderWayUntilItStands) {
  jogging_->stop_for_others();
  EXPECT_THAT(laser_.calls, Contains("stop_jog"));
  EXPECT_TRUE(jogging_->under_way());
  settle();
  EXPECT_FALSE(jogging_->under_way());
}

TEST_F(JoggingTest, AfterAResetItsRecordIsTheUnitsToEnd) {
  ASSERT_TRUE(jog(20).ok());
  jogging_->forget();
  EXPECT_FALSE(jogging_->under_way());
  EXPECT_TRUE(record_->any());
}

TEST_F(JoggingTest, NobodyIsToldOnceTheUnitIsGone) {
  ask(20);
  jogging_.reset();
  settle();
  EXPECT_FALSE(told_);
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
}

}  // namespace
}  // namespace veneer::daemon
