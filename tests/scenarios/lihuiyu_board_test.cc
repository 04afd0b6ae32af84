// The real daemon on a Lihuiyu board, through its public API and the real libusb: the board is a device file of this
// machine as far as the daemon can tell, and its own truth says what was burnt.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/calibration/test_pattern.h"
#include "tests/support/board_file.h"
#include "tests/support/guarded_record.h"
#include "tests/support/lihuiyu_job.h"
#include "tests/support/lone_daemon.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A machine in a hurry where no beam is on.
sim::BoardOptions quick_board() {
  sim::BoardOptions options;
  options.m3 = true;
  options.travel_x_mm = kLihuiyuTravelX;
  options.travel_y_mm = kLihuiyuTravelY;
  options.rapid_mm_s = 3000;
  options.homing_mm_s = 3000;
  options.acceleration_mm_s2 = 1e6;
  options.boot_time = std::chrono::milliseconds(1);
  return options;
}

class LihuiyuBoardCell : public ::testing::Test {
 protected:
  void SetUp() override {
    const Status started = daemon.start(fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin",
                                        "kind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\nboard = \"m3\"\n");
    ASSERT_TRUE(started.ok()) << started.error().message;
  }
  bool beam_on() {
    return board.with_board([](sim::LihuiyuBoard& b) { return b.beam_commanded(); });
  }
  bool at_rest() {
    return board.with_board([](sim::LihuiyuBoard& b) { return !b.beam_commanded() && !b.moving(); });
  }
  double burnt_mm() {
    double sum = 0;
    for (const auto& burn : board.burns()) sum += burn.length_mm();
    return sum;
  }
  // All that was burnt is the pattern of this size, at its place, once.
  std::string wrong_pattern(double size_mm) {
    LaserLimits limits;
    limits.travel.add(point<MachineFrame>(0, 0));
    limits.travel.add(point<MachineFrame>(kLihuiyuTravelX, kLihuiyuTravelY));
    const auto pattern = daemon::make_test_pattern(limits, {}, {.size = Millimetres(size_mm)});
    return pattern ? wrong_piece(*pattern, PieceId{}, board.burns()) : pattern.error().message;
  }
  void begin_large_pattern() {
    ASSERT_EQ(daemon.veneerctl({"reset"}).status, 0);
    ASSERT_TRUE(daemon.begin_pattern(150).ok());
    ASSERT_TRUE(daemon.wait_for([&] { return burnt_mm() > 5 && beam_on(); }));
  }
  void expect_nothing_more_is_burnt() {
    const double burnt = burnt_mm();
    board.with_board([](sim::LihuiyuBoard& b) { return b.set_consent(false), 0; });
    EXPECT_FALSE(daemon.api().post("/commands/unhold").ok());
    EXPECT_EQ(daemon.veneerctl_seen_to({"laser", "test-pattern"}).status, 1) << "an aborted cell wants Clear first";
    EXPECT_EQ(burnt_mm(), burnt);
    EXPECT_EQ(board.with_board([](sim::LihuiyuBoard& b) { return b.log().moved_without_consent_mm; }), 0);
    board.with_board([](sim::LihuiyuBoard& b) { return b.set_consent(true), 0; });
  }

  BoardFile board{quick_board()};
  LoneDaemon daemon;  // ends before its board
};

TEST_F(LihuiyuBoardCell, BurnsATestPatternOnOneCommandWhereItWasAsked) {
  const Finished burnt = daemon.veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_EQ(daemon.state(), "Complete");
  EXPECT_EQ(wrong_pattern(20), "");
  EXPECT_TRUE(board.set_up_in_order());
  EXPECT_TRUE(at_rest());
  EXPECT_THAT(board.with_board([](sim::LihuiyuBoard& b) { return b.complaints(); }), IsEmpty());
  EXPECT_EQ(board.with_board([](sim::LihuiyuBoard& b) { return b.log().beam_at_rest_s; }), 0);
}

TEST_F(LihuiyuBoardCell, RunsItDryWithTheBeamOffAndSaysWhatItCannot) {
  const Finished dry = daemon.veneerctl({"laser", "test-pattern", "--size-mm", "20", "--dry"});
  EXPECT_EQ(dry.status, 0) << dry.output;
  EXPECT_EQ(board.with_board([](sim::LihuiyuBoard& b) { return b.log().beam_on_s; }), 0);
  EXPECT_TRUE(board.with_board([](sim::LihuiyuBoard& b) { return b.homed(); }));
  const Finished checked = daemon.veneerctl({"laser", "test-pattern", "--size-mm", "20", "--check"});
  EXPECT_EQ(checked.status, 1);
  EXPECT_THAT(checked.output, HasSubstr("cannot read a job without burning it: run it dry instead (--dry)"));
  EXPECT_THAT(daemon.veneerctl({"laser", "override", "--power", "90"}).output, HasSubstr("no overrides"));
}

TEST_F(LihuiyuBoardCell, StopFromAnyClientEndsItDark) {
  for (const bool by_command : {false, true}) {
    begin_large_pattern();
    if (by_command)
      EXPECT_EQ(daemon.veneerctl({"stop"}).status, 0);
    else
      EXPECT_TRUE(daemon.api().post("/stop").ok());
    EXPECT_TRUE(daemon.wait_for([&] { return at_rest(); }));
    EXPECT_TRUE(daemon.wait_for([&] { return daemon.state() == "Aborted"; })) << daemon.state();
    expect_nothing_more_is_burnt();
    ASSERT_TRUE(daemon.api().post("/commands/clear").ok());
  }
}

TEST_F(LihuiyuBoardCell, APulledPlugIsSaidAndNothingComesBackByItself) {
  begin_large_pattern();
  board.with_board([](sim::LihuiyuBoard& b) { return b.unplug(), 0; });
  EXPECT_TRUE(daemon.wait_for([&] { return daemon.state() == "Aborted"; })) << daemon.state();
  const auto status = daemon.api().get("/status");
  ASSERT_TRUE(status.ok());
  EXPECT_THAT(status->value("reason", ""), HasSubstr("USB"));
  EXPECT_FALSE((*status)["laser"].value("connected", true));
  EXPECT_TRUE(daemon.wait_for([&] { return at_rest(); })) << "each packet ends dark";
  board.with_board([](sim::LihuiyuBoard& b) { return b.plug(), 0; });
  expect_nothing_more_is_burnt();

  // With an operator's word it burns again, from the corner it has found anew.
  ASSERT_TRUE(daemon.api().post("/commands/clear").ok());
  const auto before = static_cast<std::ptrdiff_t>(board.burns().size());
  const Finished again = daemon.veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(again.status, 0) << again.output;
  LaserLimits limits;
  limits.travel.add(point<MachineFrame>(0, 0));
  limits.travel.add(point<MachineFrame>(kLihuiyuTravelX, kLihuiyuTravelY));
  const auto burns = board.burns();
  const auto pattern = daemon::make_test_pattern(limits, {}, {.size = Millimetres(20)});
  ASSERT_TRUE(pattern.ok());
  EXPECT_EQ(wrong_piece(*pattern, PieceId{}, std::vector(burns.begin() + before, burns.end())), "");
}

TEST_F(LihuiyuBoardCell, AKilledDaemonLeavesTheBoardDarkAndAbortedUntilAnOperatorsWord) {
  begin_large_pattern();
  ASSERT_TRUE(daemon.kill_and_start_again().ok());
  ASSERT_TRUE(daemon.wait_until_checked().ok());
  EXPECT_TRUE(daemon.wait_for([&] { return at_rest(); })) << "each packet ends dark";
  const double burnt = burnt_mm();
  board.with_board([](sim::LihuiyuBoard& b) { return b.set_consent(false), 0; });
  EXPECT_EQ(daemon.state(), "Aborted");
  EXPECT_EQ(burnt_mm(), burnt);
  EXPECT_EQ(board.with_board([](sim::LihuiyuBoard& b) { return b.log().moved_without_consent_mm; }), 0);
  board.with_board([](sim::LihuiyuBoard& b) { return b.set_consent(true), 0; });
  EXPECT_EQ(daemon.veneerctl({"clear"}).status, 0);
  EXPECT_EQ(daemon.veneerctl({"laser", "test-pattern", "--size-mm", "10", "--dry"}).status, 0);
}

TEST_F(LihuiyuBoardCell, TheGuardianResetsTheBoardOfAKilledDaemonWithinASecond) {
  begin_large_pattern();
  const auto killed = std::chrono::steady_clock::now();
  daemon.kill();
  // Only a reset in motion makes the board forget where it is: what it had queued would have ended at a known place.
  EXPECT_TRUE(daemon.wait_for(
      [&] { return board.with_board([](sim::LihuiyuBoard& b) { return !b.homed() && !b.moving(); }); }));
  EXPECT_LT(std::chrono::steady_clock::now() - killed, std::chrono::seconds(1));
  EXPECT_TRUE(at_rest());
  EXPECT_TRUE(daemon.wait_for([&] { return darkened(daemon.data()); })) << "and the guardian knows it";
}

TEST_F(LihuiyuBoardCell, ABoardWithoutItsSupplyIsNamedByItsRemedy) {
  board.with_board([](sim::LihuiyuBoard& b) { return b.power_off(SteadyClock().now()), 0; });
  const Finished refused = daemon.veneerctl({"reset"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.output, HasSubstr("supply"));
  EXPECT_EQ(daemon.state(), "Aborted");
}

}  // namespace
}  // namespace veneer::tests

int main(int argc, char** argv) {
  veneer::tests::be_under_umockdev(argc, argv);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
