// What an operator may turn while the laser runs.
#include "daemon/unit/override_rules.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

TEST(OverrideRules, ThePowerIsNeverAboveTheRecipes) {
  EXPECT_TRUE(check_overrides({100, 100, 100}, true));
  EXPECT_TRUE(check_overrides({100, 100, 10}, true));
  for (const bool booked : {false, true}) {
    const Status refused = check_overrides({200, 100, 101}, booked);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
    EXPECT_THAT(refused.error().message, HasSubstr("recipe"));
  }
}

TEST(OverrideRules, WhereWoodIsBookedNoMoreIsBurntIntoAMillimetre) {
  EXPECT_TRUE(check_overrides({50, 100, 50}, true));
  EXPECT_TRUE(check_overrides({200, 100, 100}, true));
  const Status refused = check_overrides({90, 100, 100}, true);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("kerf"));
  EXPECT_THAT(refused.error().message, HasSubstr("the power at most 90 %"));
  EXPECT_TRUE(check_overrides({25, 100, 100}, false)) << "of a pattern nothing is booked";
}

TEST(OverrideRules, TheyBelongToWhatRuns) {
  for (const CellState state : {CellState::kExecute, CellState::kHeld, CellState::kSuspended, CellState::kStopping})
    EXPECT_TRUE(overrides_belong_to(state));
  for (const CellState state : {CellState::kIdle, CellState::kStopped, CellState::kComplete, CellState::kCompleting,
                                CellState::kResetting, CellState::kAborted})
    EXPECT_FALSE(overrides_belong_to(state));
}

}  // namespace
}  // namespace veneer::daemon
