// The guardian of a real daemon: what it does at the daemon's death, at its end, and what happens while it is away.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): POSIX

#include <cstdlib>

#include "tests/support/guarded_record.h"
#include "tests/support/laser_only_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class GuardianScenario : public ::testing::Test {
 protected:
  void start(const LoneDaemonOptions& options = {}) {
    auto started = LaserOnlyCell::start(bin, LaserOnlyCell::quick_laser(), options);
    ASSERT_TRUE(started.ok()) << started.error().message;
    cell = std::move(*started);
  }
  void begin_burning() {
    ASSERT_EQ(cell->veneerctl({"reset"}).status, 0);
    ASSERT_TRUE(cell->begin_pattern(300).ok());
    ASSERT_TRUE(cell->wait_for([&] { return cell->laser.beam_on(); }));
  }
  bool watched() const { return tests::watched(cell->data()); }
  // Of the guardian that the daemon has started; 0: there is none.
  int pid() const {
    const std::string find = "pgrep -f '[v]eneer-guardian --record " + (cell->data() / "guarded").string() + "'";
    return std::atoi(run_program({"/bin/sh", "-c", find}).output.c_str());
  }
  std::string refusal() const {
    const auto status = cell->api().get("/status");
    if (!status) return status.error().message;
    const auto& refusal = (*status)["laser"]["refusal"];
    return refusal.is_string() ? refusal.get<std::string>() : "";
  }

  const fs::path bin = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin";
  std::unique_ptr<LaserOnlyCell> cell;
};

TEST_F(GuardianScenario, ResetsTheMachineOfAKilledDaemonWithinASecond) {
  start();
  begin_burning();
  const std::size_t before = cell->laser.resets().size();
  const auto killed = std::chrono::steady_clock::now();
  cell->kill();
  ASSERT_TRUE(cell->wait_for([&] { return cell->laser.resets().size() > before; }));
  EXPECT_LT(cell->laser.resets()[before] - killed, std::chrono::seconds(1));
  ASSERT_TRUE(cell->wait_for([&] { return !watched(); }));
  EXPECT_FALSE(cell->laser.beam_on());
  EXPECT_FALSE(cell->laser.moving());
}

TEST_F(GuardianScenario, LeavesTheMachineOfADaemonThatEndedInOrderAlone) {
  start();
  begin_burning();
  ASSERT_TRUE(watched());
  cell->end();
  const std::size_t resets = cell->laser.resets().size();
  ASSERT_TRUE(cell->wait_for([&] { return !watched(); }));
  EXPECT_FALSE(cell->laser.beam_on());
  EXPECT_EQ(cell->laser.resets().size(), resets);
}

TEST_F(GuardianScenario, ADaemonThatIsStartedAgainWaitsForItsPredecessorsMachineToBeDark) {
  start();
  begin_burning();
  const std::size_t before = cell->laser.resets().size();
  cell->laser.set_consent(false);
  ASSERT_TRUE(cell->kill_and_start_again().ok());
  EXPECT_GT(cell->laser.resets().size(), before) << "before it answers at all";
  EXPECT_FALSE(cell->laser.beam_on());
  ASSERT_TRUE(cell->wait_until_checked().ok());
  EXPECT_EQ(refusal(), "");
  EXPECT_EQ(cell->state(), "Aborted") << "a pattern was broken off";
  EXPECT_EQ(cell->veneerctl({"clear"}).status, 0);
  cell->laser.set_consent(true);
  EXPECT_EQ(cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"}).status, 0);
}

TEST_F(GuardianScenario, NothingBurnsWhileTheGuardianIsAway) {
  const testing::TempDirectory folder;
  const std::string socket = folder / "guardian.sock";
  const auto guard = [&] {
    return *ChildProcess::start(
        {(bin / "veneer-guardian").string(), "--record", folder / "guarded", "--listen", socket}, folder / "log");
  };
  LoneDaemonOptions options;
  options.guardian = socket;
  ChildProcess guardian = guard();
  start(options);
  EXPECT_EQ(refusal(), "");
  EXPECT_EQ(cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"}).status, 0);

  guardian.kill();
  ASSERT_TRUE(cell->wait_for([&] { return !refusal().empty(); }));
  EXPECT_THAT(refusal(), HasSubstr("start veneer-guardian.service"));
  EXPECT_THAT(cell->veneerctl({"status"}).output, HasSubstr("veneer-guardian.service"));
  const double burnt = cell->laser.burnt_mm();
  ASSERT_EQ(cell->veneerctl({"reset"}).status, 0);
  const Finished refused = cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.output, HasSubstr("guardian"));
  EXPECT_EQ(cell->laser.burnt_mm(), burnt);

  // One that comes back finds a daemon that lives, and leaves its machine alone.
  const std::size_t resets = cell->laser.resets().size();
  guardian = guard();
  ASSERT_TRUE(cell->wait_for([&] { return refusal().empty(); }));
  EXPECT_EQ(cell->laser.resets().size(), resets);
  EXPECT_EQ(cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"}).status, 0);
}

TEST_F(GuardianScenario, TheDaemonsOwnGuardianIsStartedAgain) {
  start();
  const int first = pid();
  ASSERT_GT(first, 0);
  ::kill(first, SIGKILL);
  ASSERT_TRUE(cell->wait_for([&] { return pid() > 0 && pid() != first && refusal().empty(); }));
  // It has nothing of the daemon's but its own end of their connection: a socket that listens would outlive the daemon.
  const Finished sockets = run_program({"/bin/sh", "-c", fmt::format("ls -l /proc/{}/fd | grep -c socket:", pid())});
  EXPECT_EQ(sockets.output, "1\n");
  begin_burning();
  const std::size_t before = cell->laser.resets().size();
  cell->kill();
  EXPECT_TRUE(cell->wait_for([&] { return cell->laser.resets().size() > before && !watched(); }));
}

TEST_F(GuardianScenario, OneThatHangsDoesNotWatch) {
  start();
  const int first = pid();
  ASSERT_GT(first, 0);
  ::kill(first, SIGSTOP);
  EXPECT_TRUE(cell->wait_for([&] { return pid() != first; })) << "the daemon's own is replaced";
  EXPECT_TRUE(cell->wait_for([&] { return refusal().empty(); }));
}

TEST_F(GuardianScenario, WhatNobodyCouldDarkenIsDarkenedByHandOrAtTheNextStart) {
  start();
  begin_burning();
  const int guardian = pid();
  ASSERT_GT(guardian, 0);
  ::kill(guardian, SIGSTOP);
  const std::size_t before = cell->laser.resets().size();
  cell->kill();
  ::kill(guardian, SIGKILL);
  EXPECT_TRUE(watched()) << "as after a power cut";
  const Finished settled =
      run_program({(bin / "veneer-guardian").string(), "--record", (cell->data() / "guarded").string(), "--settle"});
  EXPECT_EQ(settled.status, 0) << settled.output;
  EXPECT_GT(cell->laser.resets().size(), before);
  EXPECT_FALSE(watched());
}

}  // namespace
}  // namespace veneer::tests
