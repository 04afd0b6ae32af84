// A laser while somebody, and while nobody, would darken it should the daemon die.
#include "daemon/guarded_laser.h"

#include <gmock/gmock.h>

#include "daemon/unit/preflight.h"
#include "tests/support/sim_laser.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class GuardedLaserTest : public ::testing::Test {
 protected:
  GuardedLaserTest() {
    auto laser = std::make_unique<tests::SimLaser>(io_);
    laser_ = laser.get();
    guarded_ = std::make_unique<GuardedLaser>(io_, std::move(laser), [this] { return watched_; });
  }
  void connect() {
    guarded_->connect([this](const LaserEvent& event) { events_.push_back(event); });
    run();
  }
  void run() {
    io_.restart();
    io_.poll();
  }
  static LaserJob job(double power) {
    Stroke stroke;
    stroke.path = {point<MachineFrame>(1, 1), point<MachineFrame>(9, 1)};
    stroke.speed = MmPerSecond(20);
    stroke.power = PowerFraction(power);
    return {{stroke}};
  }
  std::string failure() const {
    const auto* failed = events_.empty() ? nullptr : std::get_if<laser_event::Failed>(&events_.back());
    return failed == nullptr ? "" : failed->error.message;
  }
  void lose_the_guardian() { watched_ = Error{ErrorCode::kRefused, "the guardian does not answer"}; }

  boost::asio::io_context io_;
  Status watched_ = Ok();
  tests::SimLaser* laser_ = nullptr;
  std::unique_ptr<GuardedLaser> guarded_;
  std::vector<LaserEvent> events_;
};

TEST_F(GuardedLaserTest, IsTheLaserItselfWhileSomebodyWatches) {
  connect();
  guarded_->start(job(0.5));
  run();
  EXPECT_THAT(laser_->calls, ElementsAre("connect", "start"));
  EXPECT_EQ(guarded_->status().refusal, "");
  EXPECT_TRUE(std::holds_alternative<laser_event::Done>(events_.back()));
}

TEST_F(GuardedLaserTest, IsNotEvenConnectedWhileNobodyWatches) {
  lose_the_guardian();
  connect();
  EXPECT_THAT(laser_->calls, IsEmpty());
  EXPECT_THAT(failure(), HasSubstr("guardian"));
}

TEST_F(GuardedLaserTest, BeginsNoBeamWhileNobodyWatchesButADarkWay) {
  connect();
  lose_the_guardian();
  guarded_->start(job(0.5));
  run();
  EXPECT_THAT(laser_->calls, Not(Contains("start")));
  EXPECT_THAT(failure(), HasSubstr("guardian"));
  guarded_->start(job(0));
  run();
  EXPECT_THAT(laser_->calls, Contains("start"));
}

TEST_F(GuardedLaserTest, StaysHeldWhileNobodyWatches) {
  connect();
  laser_->burn_at_once = false;
  guarded_->start(job(0.5));
  guarded_->hold();
  run();
  lose_the_guardian();
  guarded_->resume();
  run();
  EXPECT_THAT(laser_->calls, Not(Contains("resume")));
  EXPECT_TRUE(std::holds_alternative<laser_event::Held>(events_.back()));
  guarded_->abort();
  EXPECT_EQ(laser_->calls.back(), "abort") << "which needs nobody";
}

TEST_F(GuardedLaserTest, TheCheckBeforeMotionSaysWhy) {
  connect();
  EXPECT_TRUE(check_machine(guarded_->status()).ok());
  lose_the_guardian();
  const Status refused = check_machine(guarded_->status());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("guardian"));
}

}  // namespace
}  // namespace veneer::daemon
