#include <gmock/gmock.h>

#include "tests/support/grbl_bench.h"

namespace veneer::sim {
namespace {

using ::testing::Each;
using ::testing::EndsWith;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Property;
using ::testing::StartsWith;

TEST(GrblController, MovesOnATrapezoid) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("G90 G1 F6000 X-101\n"), "ok\r\n");  // 100 mm at 100 mm/s, 1500 mm/s2
  double seconds = 0;
  bench.run_out(&seconds);
  EXPECT_NEAR(seconds, 1 + 100.0 / 1500, 1e-6);
  EXPECT_NEAR(bench.controller.head().x_mm, -101, 1e-9);
}

TEST(GrblController, IsWhereATrapezoidPutsItHoweverOftenItIsAsked) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G90 G1 F6000 X-101\n");
  bench.wait(0.03);
  bench.wait(0.003);
  EXPECT_NEAR(bench.controller.head().x_mm, -1 - 0.5 * 1500 * 0.033 * 0.033, 1e-6);
  EXPECT_THAT(bench.send("?"), HasSubstr("|FS:2970,0"));
  bench.wait(0.5);
  const double ramp = 100.0 / 1500;
  EXPECT_NEAR(bench.controller.head().x_mm, -1 - (0.5 * 100 * ramp + 100 * (0.533 - ramp)), 1e-6);
}

TEST(GrblController, RunsThroughStraightJoinsAndSlowsForCorners) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91 G1 F6000\n");
  for (int i = 0; i < 10; ++i) bench.send("X-10\n");
  double straight = 0;
  bench.run_out(&straight);
  EXPECT_NEAR(straight, 1 + 100.0 / 1500, 1e-4);
  for (int i = 0; i < 5; ++i) bench.send("X10\nY-10\n");
  double corners = 0;
  bench.run_out(&corners);
  EXPECT_GT(corners, 1.3 * straight);
}

TEST(GrblController, BurnsTheSameEnergyOnEveryMillimetreInDynamicMode) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91 M4 S850 G1 F900\n");  // 15 mm/s
  bench.send("X-20\nY-20\nX20\nY20\n");
  bench.run_out();
  EXPECT_NEAR(bench.burnt_mm(), 80, 1e-6);
  for (const BurnSegment& burn : bench.burns) EXPECT_NEAR(burn.energy_per_mm(), 0.85 / 15, 1e-9);
  EXPECT_EQ(bench.controller.beam_log().beam_at_rest_s, 0);
  EXPECT_FALSE(bench.controller.beam_on());
}

TEST(GrblController, IsDarkInRapidsAndAtRestInDynamicMode) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M4 S1000 F600\nG0 X-50\n");
  bench.wait(0.05);
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_THAT(bench.send("?"), HasSubstr(",0|"));
  bench.run_out();
  bench.send("G1\n");
  bench.wait(1);
  EXPECT_TRUE(bench.burns.empty());
}

TEST(GrblController, KeepsAConstantBeamOnAtRestAndSaysSo) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M3 S200 G1 F600 X-11\n");
  bench.run_out();
  EXPECT_TRUE(bench.controller.beam_on());
  bench.wait(0.5);
  EXPECT_THAT(bench.send("?"), HasSubstr("|FS:0,200"));
  EXPECT_NEAR(bench.controller.beam_log().beam_at_rest_s, 0.5, 1e-3);
  bench.send("G0\n");
  EXPECT_FALSE(bench.controller.beam_on());
}

TEST(GrblController, BurnsMoreWhereAConstantBeamSlowsDown) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M3 S500 G1 F6000 X-11\nM5\n");
  bench.run_out();
  ASSERT_GE(bench.burns.size(), 2U);
  EXPECT_GT(bench.burns.front().energy_per_mm(), 0.5 / 100 * 1.5);
}

TEST(GrblController, CutsArcsIntoChordsWithinTolerance) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G0 X-50 Y-50\n");
  bench.run_out();
  bench.send("M4 S500 F1200 G2 X-50 Y-50 I10\n");
  bench.run_out();
  EXPECT_NEAR(bench.burnt_mm(), 20 * 3.14159265, 0.03);
  for (const BurnSegment& burn : bench.burns)
    EXPECT_NEAR(std::hypot((burn.from.x_mm + burn.to.x_mm) / 2 + 40, (burn.from.y_mm + burn.to.y_mm) / 2 + 50), 10,
                0.012);
  bench.burns.clear();
  bench.send("G3 X-50 Y-30 R10\n");
  bench.run_out();
  EXPECT_NEAR(bench.burnt_mm(), 10 * 3.14159265, 0.02);
  EXPECT_NEAR(bench.burns[bench.burns.size() / 2].to.x_mm, -40, 0.6);  // counter-clockwise bulges to +x
}

TEST(GrblController, HoldsWithTheBeamOffAndGoesOnWhereItStopped) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M4 S850 G1 F900 X-31\n");
  bench.wait(0.5);
  bench.send("!");
  EXPECT_THAT(bench.send("?"), StartsWith("<Hold:1|"));
  bench.wait(0.1);
  EXPECT_THAT(bench.send("?"), AllOf(StartsWith("<Hold:0|"), HasSubstr("|FS:0,0")));
  EXPECT_EQ(bench.send("G0X-5\n"), "");  // lines wait
  EXPECT_FALSE(bench.controller.beam_on());
  bench.wait(10);
  EXPECT_EQ(bench.send("~"), "[MSG:Restoring spindle]\r\nok\r\n");
  bench.run_out();
  EXPECT_NEAR(bench.burnt_mm(), 30, 1e-6);
  EXPECT_NEAR(bench.controller.head().x_mm, -5, 1e-6);
  EXPECT_EQ(bench.controller.beam_log().beam_at_rest_s, 0);
}

TEST(GrblController, DarkensAConstantBeamInAHold) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M3 S500 G1 F900 X-31\n");
  bench.wait(0.5);
  bench.send("!");
  bench.wait(0.2);
  EXPECT_EQ(bench.controller.state(), "Hold:0");
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_EQ(bench.controller.beam_log().beam_at_rest_s, 0);
}

TEST(GrblController, ResetInAHoldKeepsThePositionResetInMotionLosesIt) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G1 F900 X-31\n");
  bench.wait(0.5);
  bench.send("!");
  bench.wait(0.2);
  EXPECT_EQ(bench.send("\x18"), "\r\nGrbl 1.1h ['$' for help]\r\n");
  EXPECT_EQ(bench.controller.state(), "Idle");
  EXPECT_TRUE(bench.controller.homed());
  bench.send("M4 S500 G1 F900 X-31\n");
  bench.wait(0.5);
  EXPECT_TRUE(bench.controller.beam_on());
  EXPECT_THAT(bench.send("\x18"), StartsWith("ALARM:3\r\n\r\nGrbl 1.1h"));
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_EQ(bench.controller.state(), "Alarm");
  EXPECT_FALSE(bench.controller.homed());
  EXPECT_EQ(bench.send("G0X0\n"), "error:9\r\n");
}

TEST(GrblController, RaisesAlarmTwoAtTheSoftLimitAndFallsSilent) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("G0 X-519.9\n"), "ok\r\n");
  bench.wait(0.3);
  EXPECT_EQ(bench.send("G0 X-520.1\n"), "");
  EXPECT_EQ(bench.controller.state(), "Hold:1");
  const std::string said = bench.run_out();
  EXPECT_EQ(said, "ALARM:2\r\n[MSG:Reset to continue]\r\n");
  EXPECT_EQ(bench.send("?"), "");
  EXPECT_THAT(bench.send("\x18"), EndsWith("[MSG:'$H'|'$X' to unlock]\r\n"));
}

TEST(GrblController, JogsAndCancels) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("$J=G91 X-100 F3000\n"), "ok\r\n");
  EXPECT_EQ(bench.controller.state(), "Jog");
  EXPECT_EQ(bench.send("G0 X-1\n"), "error:9\r\n");
  bench.wait(0.5);
  bench.send("\x85");
  bench.wait(0.2);
  EXPECT_EQ(bench.controller.state(), "Idle");
  EXPECT_GT(bench.controller.head().x_mm, -30);
  EXPECT_THAT(bench.send("$G\n"), HasSubstr("G90"));
  const double stopped = bench.controller.head().x_mm;
  bench.send("G91 G0 X-1\n");
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, stopped - 1, 0.02);
}

TEST(GrblController, StopsForTheLidAndWaitsForItAndForAPerson) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M4 S850 G1 F900 X-31\n");
  bench.wait(0.5);
  bench.controller.set_lid(true, bench.clock.now());
  EXPECT_FALSE(bench.controller.beam_on());  // the interlock is at once, the controller slows down first
  EXPECT_THAT(bench.send("?"), StartsWith("<Door:2|"));
  bench.wait(0.2);
  EXPECT_THAT(bench.send("?"), AllOf(StartsWith("<Door:1|"), HasSubstr("|Pn:D")));
  bench.send("~");
  EXPECT_EQ(bench.controller.state(), "Door:1");
  bench.controller.set_lid(false, bench.clock.now());
  EXPECT_EQ(bench.controller.state(), "Door:0");
  bench.wait(5);
  EXPECT_EQ(bench.controller.state(), "Door:0");
  bench.send("~");
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, -31, 1e-6);
  EXPECT_GT(bench.controller.beam_log().beam_while_lid_open_s, 0);
  EXPECT_LT(bench.burnt_mm(), 30);  // what passed under a dark tube is not cut
}

TEST(GrblController, TakesOverridesInFlight) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G1 F1000 X-101\n");
  bench.wait(1);
  bench.send("\x91\x91");
  bench.wait(0.5);
  EXPECT_THAT(bench.send("?"), HasSubstr("|FS:1200,0"));
  bench.send("\x90");
  bench.wait(0.5);
  EXPECT_THAT(bench.send("?"), HasSubstr("|FS:1000,0"));
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, -101, 1e-9);
}

TEST(GrblController, DwellsAfterTheMotionBeforeIt) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G1 F6000 X-101\n");
  EXPECT_EQ(bench.send("G4 P0.5\n"), "");
  double seconds = 0;
  EXPECT_EQ(bench.run_out(&seconds), "ok\r\n");
  EXPECT_NEAR(seconds, 1 + 100.0 / 1500 + 0.5, 1e-6);
}

TEST(GrblController, PausesForM0AndEndsWithM2) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("M0\n"), "");
  EXPECT_EQ(bench.controller.state(), "Hold:0");
  EXPECT_EQ(bench.send("~"), "ok\r\n");
  bench.send("G91 M4 S5\n");
  EXPECT_EQ(bench.send("M2\n"), "[MSG:Pgm End]\r\nok\r\n");
  EXPECT_THAT(bench.send("$G\n"), HasSubstr("G90 G94 M5"));
}

TEST(GrblController, LogsTheLongestQueuedMotion) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91 G1 F600\nX-5\nX-5\n");  // a second in all, and acceleration
  bench.run_out();
  EXPECT_NEAR(bench.controller.beam_log().longest_queued_motion_s, 1.0 + 10.0 / 1500, 1e-3);
}

TEST(GrblController, LogsMotionWithoutConsent) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.set_consent(false);
  bench.send("M4 S500 G1 F600 X-6\n");
  bench.run_out();
  EXPECT_NEAR(bench.controller.beam_log().moved_without_consent_mm, 5, 1e-6);
  EXPECT_NEAR(bench.controller.beam_log().burnt_without_consent_mm, 5, 1e-6);
}

TEST(GrblController, MovesAHeadThatStandsElsewhereThanItBelievesUntilHomed) {
  GrblBench bench;
  bench.controller.put_head({-200, -100});
  bench.controller.power_on(bench.clock.now());
  bench.send("$X\nM4 S500 G91 G1 F600 X-5\n");
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, -205, 1e-6);
  EXPECT_NEAR(bench.controller.beam_log().burnt_unhomed_mm, 5, 1e-6);
  EXPECT_THAT(bench.send("?"), HasSubstr("MPos:-5.000,0.000"));
}

TEST(GrblController, GoesDarkByItselfWhenTheBytesStop) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91 M4 S850 G1 F900\nX-5\nX-5\n");
  bench.controller.unplug(bench.clock.now());
  bench.wait(60);
  EXPECT_NEAR(bench.burnt_mm(), 10, 1e-6);
  EXPECT_FALSE(bench.controller.beam_on());
}

}  // namespace
}  // namespace veneer::sim
