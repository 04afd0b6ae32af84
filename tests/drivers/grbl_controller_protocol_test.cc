#include <gmock/gmock.h>

#include "tests/support/grbl_bench.h"

namespace veneer::sim {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kBanner = "\r\nGrbl 1.1h ['$' for help]\r\n";

TEST(GrblController, GreetsInAlarmUntilHomed) {
  GrblBench bench;
  bench.controller.power_on(bench.clock.now());
  EXPECT_EQ(bench.controller.take_output(), std::string(kBanner) + "[MSG:'$H'|'$X' to unlock]\r\n");
  EXPECT_EQ(bench.controller.state(), "Alarm");
  EXPECT_EQ(bench.send("G0 X-10\n"), "error:9\r\n");
  EXPECT_EQ(bench.send("$X\n"), "[MSG:Caution: Unlocked]\r\nok\r\n");
  EXPECT_EQ(bench.controller.state(), "Idle");
  EXPECT_FALSE(bench.controller.homed());
}

TEST(GrblController, BootsOnlyAfterItsBootTimeAndLosesWhatCameBefore) {
  GrblBench bench(GrblSettings::laser_cutter(), GrblOptions{.boot_time = std::chrono::milliseconds(1500)});
  bench.controller.power_on(bench.clock.now());
  EXPECT_EQ(bench.send("$I\n"), "");
  EXPECT_THAT(bench.wait(1.6), StartsWith(kBanner));
  EXPECT_THAT(bench.send("$I\n"), HasSubstr("[VER:1.1h.20190830:]\r\n[OPT:V+,15,128]\r\nok\r\n"));
}

TEST(GrblController, SaysNothingWhileHomingAndStandsAtThePullOffAfterIt) {
  GrblBench bench;
  bench.controller.power_on(bench.clock.now());
  bench.controller.take_output();
  EXPECT_EQ(bench.send("$H\n"), "");
  EXPECT_EQ(bench.send("?"), "");
  EXPECT_EQ(bench.controller.state(), "Home");
  EXPECT_TRUE(bench.controller.moving());
  const std::string said = bench.run_out();
  EXPECT_THAT(said, StartsWith("ok\r\n<Idle|MPos:-1.000,-1.000,0.000|Bf:15,128|FS:0,0"));
  EXPECT_DOUBLE_EQ(bench.controller.head().x_mm, -1);
  EXPECT_TRUE(bench.controller.homed());
}

TEST(GrblController, AnswersEmptyLinesCommentsAndBothHalvesOfCrLf) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("\n"), "ok\r\n");
  EXPECT_EQ(bench.send("(a remark)\n"), "ok\r\n");
  EXPECT_EQ(bench.send("; another\n"), "ok\r\n");
  EXPECT_EQ(bench.send("G21\r\n"), "ok\r\nok\r\n");
  EXPECT_EQ(bench.send("g 9 0 (spaces and small letters)\n"), "ok\r\n");
}

struct Wrong {
  const char* line;
  int error;
};

class GrblErrors : public ::testing::TestWithParam<Wrong> {};

TEST_P(GrblErrors, HaveGrblsNumbers) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send(std::string(GetParam().line) + "\n"), "error:" + std::to_string(GetParam().error) + "\r\n");
  EXPECT_EQ(bench.controller.state(), "Idle");
}

INSTANTIATE_TEST_SUITE_P(
    Lines, GrblErrors,
    ::testing::Values(Wrong{"5X", 1}, Wrong{"GX1", 2}, Wrong{"$Q", 3}, Wrong{"$999=1", 3}, Wrong{"$130=X", 2},
                      Wrong{"G1X-5F-100", 4}, Wrong{"$130=-4", 4}, Wrong{"M3.5", 23}, Wrong{"G0.012", 23},
                      Wrong{"G1X-5", 22}, Wrong{"G0X-1Q3", 20}, Wrong{"M7", 20}, Wrong{"G5", 20}, Wrong{"G0G90G91", 21},
                      Wrong{"M3M5", 21}, Wrong{"G0G10L2P1X1", 24}, Wrong{"G0X-1X-2", 25}, Wrong{"G2F100", 26},
                      Wrong{"G4", 28}, Wrong{"G53G80", 30}, Wrong{"G80X-1", 31}, Wrong{"G2Z-1R5F100", 32},
                      Wrong{"G2X-1Y-1R5F100", 33}, Wrong{"G2X-30Y-1R5F100", 34}, Wrong{"G2X-5F100", 35},
                      Wrong{"G0X-1P3", 36}, Wrong{"$J=X-5", 22}, Wrong{"$J=X5F100", 15}, Wrong{"$J=M3X-5F100", 16},
                      Wrong{"G10L2P9X0", 29}, Wrong{"N10000001G0", 27}, Wrong{"T256", 38}));

TEST(GrblController, RefusesLinesBeyondSeventyNineCharacters) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("G1F600X-" + std::string(72, '1') + "\n"), "error:11\r\n");
  EXPECT_EQ(bench.send("G0" + std::string(90, ' ') + "\n"), "ok\r\n");
}

TEST(GrblController, AcknowledgesWhatIsPlannedAndHoldsBackTheOkOnAFullPlanner) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91 G1 F600\n");
  std::string said;
  for (int i = 0; i < 16; ++i) said += bench.send("X-1\n");
  std::string oks;
  for (int i = 0; i < 15; ++i) oks += "ok\r\n";
  EXPECT_EQ(said, oks);
  EXPECT_THAT(bench.send("?"), HasSubstr("|Bf:0,128|"));
  EXPECT_EQ(bench.wait(0.2), "ok\r\n");  // a block has ended
}

TEST(GrblController, LosesBytesThatOverrunItsBufferInSilence) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91G1F600\n");
  std::string stream;
  for (int i = 0; i < 60; ++i) stream += "X-1.000\n";
  std::string said = bench.send(stream);
  said += bench.run_out();
  std::size_t answers = 0;
  for (std::size_t at = said.find("\r\n"); at != std::string::npos; at = said.find("\r\n", at + 1)) ++answers;
  EXPECT_LT(answers, 60U);
  EXPECT_GT(bench.controller.beam_log().lost_bytes, 0U);
}

TEST(GrblController, KeepsEveryByteOfASenderThatCounts) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G91G1F6000\n");
  const std::string line = "X-0.500\n";
  int sent = 0;
  int answered = 0;
  while (answered < 400) {
    std::string burst;
    while (sent < 400 && (sent - answered + 1) * line.size() <= 128) {
      burst += line;
      ++sent;
    }
    std::string said = bench.send(burst);
    if (const auto next = bench.controller.next_event_time()) said += bench.wait(0.01);
    for (std::size_t at = said.find("ok\r\n"); at != std::string::npos; at = said.find("ok\r\n", at + 1)) ++answered;
  }
  bench.run_out();
  EXPECT_EQ(bench.controller.beam_log().lost_bytes, 0U);
  EXPECT_NEAR(bench.controller.head().x_mm, -201, 1e-6);
}

TEST(GrblController, TakesItsTimeOnAPacedWire) {
  GrblBench bench(GrblSettings::laser_cutter(), GrblOptions{.pace_baud = 115200});
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("G21\n"), "");
  EXPECT_EQ(bench.wait(0.0006), "");  // 4 bytes in take 347 us, 4 bytes out the same
  EXPECT_EQ(bench.wait(0.0002), "ok\r\n");
}

TEST(GrblController, CarriesOffsetAndOverridesInTurn) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G92 X5\n");
  EXPECT_THAT(bench.send("?"), AllOf(HasSubstr("|WCO:-6.000,0.000,0.000>"), Not(HasSubstr("|Ov:"))));
  EXPECT_THAT(bench.send("?"), HasSubstr("|Ov:100,100,100>"));
  for (int i = 0; i < 8; ++i) EXPECT_THAT(bench.send("?"), Not(HasSubstr("WCO")));
  EXPECT_THAT(bench.send("?"), HasSubstr("|WCO:"));
  bench.send("\x92");
  EXPECT_THAT(bench.send("?"), HasSubstr("|Ov:90,100,100"));
}

TEST(GrblController, TellsItsModalStateAndOffsets) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("$G\n"), "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n");
  bench.send("G55 G91 M4 S200 F1200 G1\n");
  EXPECT_EQ(bench.send("$G\n"), "[GC:G1 G55 G17 G21 G91 G94 M4 M9 T0 F1200 S200]\r\nok\r\n");
  bench.send("M5\n");
  EXPECT_EQ(bench.send("G10 L2 P2 X-10 Y-20\n"), "");
  EXPECT_EQ(bench.run_out(), "ok\r\n");
  EXPECT_THAT(bench.send("$#\n"), HasSubstr("[G55:-10.000,-20.000,0.000]\r\n"));
  EXPECT_THAT(bench.send("\x18"), EndsWith(kBanner));
  EXPECT_THAT(bench.send("$#\n"), HasSubstr("[G55:-10.000,-20.000,0.000]\r\n"));
  EXPECT_EQ(bench.send("$G\n"), "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n");
}

TEST(GrblController, ListsAndStoresSettings) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_THAT(bench.send("$$\n"), AllOf(HasSubstr("$32=1\r\n"), HasSubstr("$130=520.000\r\n"), EndsWith("ok\r\n")));
  EXPECT_EQ(bench.send("$30=255\n"), "");  // EEPROM takes its time
  EXPECT_EQ(bench.run_out(), "ok\r\n");
  EXPECT_THAT(bench.send("$$\n"), HasSubstr("$30=255.000\r\n"));
}

TEST(GrblController, DropsBytesWhileItWritesEeprom) {
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("$10=1\nG0X-50\n");
  EXPECT_EQ(bench.run_out(), "ok\r\n");
  EXPECT_EQ(bench.controller.head().x_mm, -1);
}

TEST(GrblController, ChecksWithoutMovingAndLeavesCheckModeByReset) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("$C\n"), "[MSG:Enabled]\r\nok\r\n");
  EXPECT_EQ(bench.send("M4 S500 G1 F600 X-100\n"), "ok\r\n");
  EXPECT_EQ(bench.send("G1 X-100 P3\n"), "error:36\r\n");
  EXPECT_FALSE(bench.controller.moving());
  EXPECT_EQ(bench.send("$C\n"), std::string("[MSG:Disabled]\r\nok\r\n") + kBanner);
  EXPECT_TRUE(bench.burns.empty());
  bench.send("$C\n");
  EXPECT_EQ(bench.send("G0 X5\n"), "ALARM:2\r\n[MSG:Reset to continue]\r\n");
}

TEST(GrblController, SleepsUntilReset) {
  GrblBench bench;
  bench.power_on_and_home();
  EXPECT_EQ(bench.send("$SLP\n"), "ok\r\n[MSG:Sleeping]\r\n");
  EXPECT_EQ(bench.send("G0X-5\n"), "");
  EXPECT_THAT(bench.send("\x18"), HasSubstr("[MSG:'$H'|'$X' to unlock]"));
}

}  // namespace
}  // namespace veneer::sim
