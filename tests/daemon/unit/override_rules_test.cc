// What an operator may turn while the laser runs.
#include "daemon/unit/override_rules.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <iostream>

#include "tests/support/grbl_cell.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
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

TEST(OverrideRules, TheBeamThatFollowsTheSpeedIsNoStrongerThanTheRecipeEither) {
  for (const bool booked : {false, true}) {
    EXPECT_TRUE(check_overrides({200, 100, 50}, booked));
    EXPECT_TRUE(check_overrides({150, 100, 66}, booked));
    const Status refused = check_overrides({150, 100, 67}, booked);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
    EXPECT_THAT(refused.error().message, AllOf(HasSubstr("at most 66 %"), HasSubstr("the feed at most 149 %")));
  }
}

// What the tube does on the way to overrides, at them and back, seen by the simulated controller's own beam.
struct Burnt {
  double strongest = 0, most_energy = 0;  // of what the recipe says
};
Burnt burn_with(const LaserOverrides& overrides) {
  constexpr double kPower = 0.4, kSpeed = 20;
  tests::GrblCell cell;
  cell.connect_and_home();
  Burnt burnt;
  cell.on_step = [&] { burnt.strongest = std::max(burnt.strongest, cell.bench.controller.beam_power() / kPower); };
  LaserJob job;
  job.strokes.push_back({PieceId{1},
                         StrokeRole::kCut,
                         {point<MachineFrame>(50, 100), point<MachineFrame>(450, 100), point<MachineFrame>(50, 110)},
                         MmPerSecond(kSpeed),
                         PowerFraction(kPower),
                         1});
  cell.start(job);
  cell.run(60, [&] { return cell.bench.controller.beam_on(); });
  const auto turn = [&](const LaserOverrides& wanted) {
    EXPECT_TRUE(cell.core.set_overrides(wanted, cell.now()));
    cell.exchange();
    cell.run(10, [&] { return cell.core.status().overrides == wanted; });
    EXPECT_EQ(cell.core.status().overrides, wanted);
  };
  turn(overrides);
  turn({});
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
  for (const sim::BurnSegment& segment : cell.bench.burns)
    if (segment.length_mm() > 0)
      burnt.most_energy = std::max(burnt.most_energy, segment.energy_per_mm() * kSpeed / kPower);
  return burnt;
}

TEST(OverrideRules, WhatTheyAllowBurnsNeitherStrongerNorMoreIntoAMillimetreThanTheRecipe) {
  int allowed = 0;
  double strongest = 0, most_energy = 0;
  for (const int feed : {25, 50, 90, 100, 111, 125, 150, 200})
    for (const int power : {10, 25, 50, 66, 80, 90, 100}) {
      const LaserOverrides overrides{feed, 100, power};
      if (!check_overrides(overrides, true)) continue;
      ++allowed;
      const Burnt burnt = burn_with(overrides);
      EXPECT_LE(burnt.strongest, 1.005) << "feed " << feed << " %, power " << power << " %";
      EXPECT_LE(burnt.most_energy, 1.005) << "feed " << feed << " %, power " << power << " %";
      strongest = std::max(strongest, burnt.strongest);
      most_energy = std::max(most_energy, burnt.most_energy);
    }
  EXPECT_GT(allowed, 20);
  std::cout << allowed << " overrides: beam at most " << strongest << ", energy a millimetre at most " << most_energy
            << " of the recipe's\n";
}

TEST(OverrideRules, WithoutThemTheBeamWouldBeStronger) {
  EXPECT_NEAR(burn_with({150, 100, 100}).strongest, 1.5, 0.02);
  EXPECT_NEAR(burn_with({150, 100, 66}).strongest, 1.0, 0.02);
}

TEST(OverrideRules, WhereWoodIsBookedNoMoreIsBurntIntoAMillimetre) {
  EXPECT_TRUE(check_overrides({50, 100, 50}, true));
  EXPECT_TRUE(check_overrides({200, 100, 50}, true));
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
