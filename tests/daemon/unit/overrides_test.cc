// Overrides and the state of the unit: while something runs they are taken, and they do not outlast it.
#include "daemon/unit/overrides.h"

#include <gmock/gmock.h>

#include "tests/support/sim_laser.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class OverridesTest : public ::testing::Test {
 protected:
  OverridesTest() {
    laser_.can_override = true;
    view_.state = CellState::kExecute;
  }
  void enter(CellState state) {
    view_.state = state;
    overrides_.state_entered();
  }

  boost::asio::io_context io_;
  tests::SimLaser laser_{io_};
  CellView view_;
  int changes_ = 0;
  Overrides overrides_{laser_, view_, [this] { ++changes_; }};
};

TEST_F(OverridesTest, AreTheLasersWhileSomethingRuns) {
  EXPECT_TRUE(overrides_.set({80, 100, 80}).ok());
  EXPECT_EQ(laser_.overrides, (LaserOverrides{80, 100, 80}));
  EXPECT_EQ(overrides_.wanted(), laser_.overrides);
  EXPECT_EQ(changes_, 1);
}

TEST_F(OverridesTest, EndWithWhatRuns) {
  ASSERT_TRUE(overrides_.set({80, 100, 80}).ok());
  enter(CellState::kHeld);
  EXPECT_EQ(laser_.overrides, (LaserOverrides{80, 100, 80})) << "it goes on after Unhold";
  enter(CellState::kCompleting);
  EXPECT_EQ(laser_.overrides, LaserOverrides{});
}

TEST_F(OverridesTest, WhereNothingRunsNoneIsTaken) {
  enter(CellState::kIdle);
  const Status refused = overrides_.set({80, 100, 80});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(laser_.overrides, LaserOverrides{});
  EXPECT_EQ(changes_, 0);
}

TEST_F(OverridesTest, ALaserWithoutThemSaysSoWhateverTheUnitDoes) {
  laser_.can_override = false;
  for (const CellState state : {CellState::kIdle, CellState::kExecute}) {
    enter(state);
    EXPECT_THAT(overrides_.set({80, 100, 80}).error().message, HasSubstr("this laser has no overrides"));
  }
}

TEST_F(OverridesTest, WhereWoodIsBookedTheKerfCounts) {
  EXPECT_TRUE(overrides_.set({50, 100, 80}).ok()) << "of a pattern nothing is booked";
  view_.recutting = true;
  EXPECT_THAT(overrides_.set({50, 100, 80}).error().message, HasSubstr("kerf"));
  view_.recutting = false;
  view_.job = JobView{JobId{1}, "test", 3, 0, 0, {}, 0};
  EXPECT_THAT(overrides_.set({50, 100, 80}).error().message, HasSubstr("kerf"));
}

}  // namespace
}  // namespace veneer::daemon
