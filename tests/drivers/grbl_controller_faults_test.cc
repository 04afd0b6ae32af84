#include <gmock/gmock.h>

#include "tests/support/grbl_bench.h"

namespace veneer::sim {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(GrblFaults, AreKnownByName) {
  EXPECT_EQ(*fault_kind("fuse_lines"), FaultKind::kFuseLines);
  EXPECT_EQ(fault_kind("gremlin").error().code, ErrorCode::kNotFound);
}

TEST(GrblFaults, DropAndDuplicateTheOk) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kDropOk, 2});
  EXPECT_EQ(bench.send("G21\n"), "ok\r\n");
  EXPECT_EQ(bench.send("G21\n"), "");
  EXPECT_EQ(bench.send("G21\n"), "ok\r\n");
  bench.controller.inject({FaultKind::kDuplicateOk, 1});
  EXPECT_EQ(bench.send("G21\n"), "ok\r\nok\r\n");
}

TEST(GrblFaults, GarbleAByte) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kGarbleByte, 1});
  EXPECT_THAT(bench.send("G21\n"), ::testing::Not("ok\r\n"));
}

TEST(GrblFaults, ADroppedDigitLeavesAValidLine) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kDropByte, 6});
  EXPECT_EQ(bench.send("G0X-123\n"), "ok\r\n");
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, -13, 1e-6);
}

TEST(GrblFaults, FuseTwoLines) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kFuseLines, 1});
  EXPECT_EQ(bench.send("G21\nG90\n"), "ok\r\n");
}

TEST(GrblFaults, StallIsDarkAndSilent) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M4 S500 G1 F600 X-100\n");
  bench.wait(0.2);
  bench.controller.inject({FaultKind::kStall});
  bench.send("G21\n");
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_EQ(bench.send("?\x18"), "");
  EXPECT_FALSE(bench.controller.moving());
  bench.controller.power_on(bench.clock.now());
  EXPECT_THAT(bench.controller.take_output(), HasSubstr("Grbl 1.1h"));
}

TEST(GrblFaults, UnplugLosesBothDirectionsButNotThePosition) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kUnplug, 4});
  EXPECT_EQ(bench.send("G0X-50\n"), "");
  EXPECT_FALSE(bench.controller.link_up());
  EXPECT_EQ(bench.send("?"), "");
  bench.controller.plug();
  EXPECT_THAT(bench.send("?"), StartsWith("<Idle|MPos:-1.000"));
}

TEST(GrblFaults, ABrownOutResetsInTheMiddle) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("M4 S500 G1 F600 X-100\n");
  bench.wait(0.2);
  bench.controller.inject({FaultKind::kBanner});
  EXPECT_THAT(bench.send("X-90\n"), StartsWith("\r\nGrbl 1.1h"));
  EXPECT_EQ(bench.controller.state(), "Alarm");
  EXPECT_FALSE(bench.controller.homed());
  EXPECT_THAT(bench.send("?"), HasSubstr("MPos:0.000,0.000"));
}

TEST(GrblFaults, ErrorsAndAlarmsOfAnyNumber) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kError, 1, 2});
  EXPECT_EQ(bench.send("G0X-50\n"), "error:2\r\n");
  EXPECT_FALSE(bench.controller.moving());
  bench.controller.inject({FaultKind::kAlarm, 1, 1});
  EXPECT_EQ(bench.send("G0X-50\n"), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
  EXPECT_EQ(bench.send("?"), "");
  EXPECT_FALSE(bench.controller.homed());
}

TEST(GrblFaults, ASlipIsSeenOnlyOnTheWood) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.controller.inject({FaultKind::kSlip, 1, 400});
  bench.send("G0X-50\n");
  bench.run_out();
  EXPECT_NEAR(bench.controller.head().x_mm, -49.6, 1e-6);
  EXPECT_THAT(bench.send("?"), HasSubstr("MPos:-50.000"));
}

}  // namespace
}  // namespace veneer::sim
