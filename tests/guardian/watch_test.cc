// The guardian's words with a daemon, and what it does at each kind of end.
#include "guardian/watch.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_directory.h"

namespace veneer::guardian {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const GuardedMachine kMachine{"grbl", "serial:/dev/ttyUSB0?baud=115200"};

// A daemon's end of the connection, and the guardian on a thread of its own at the other.
class Daemon {
 public:
  explicit Daemon(const WatchOptions& options) {
    socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data());
    guardian_ = std::thread([this, options] {
      Watch(options, make_null_logger()).serve(ends_[1]);
      close(ends_[1]);
    });
  }
  ~Daemon() {
    dies();
    await_guardian();
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  void say(const std::string& line) const { say_part(line + "\n"); }
  // The guardian may be gone by now.
  void say_part(const std::string& text) const {
    static_cast<void>(send(ends_[0], text.data(), text.size(), MSG_NOSIGNAL));
  }
  // One line of the guardian's, or "" at its end.
  std::string hear() const {
    std::string line;
    for (char c = 0; read(ends_[0], &c, 1) == 1 && c != '\n';) line += c;
    return line;
  }
  void dies() {
    if (ends_[0] >= 0) close(std::exchange(ends_[0], -1));
  }
  void await_guardian() {
    if (guardian_.joinable()) guardian_.join();
  }

 private:
  std::array<int, 2> ends_{-1, -1};
  std::thread guardian_;
};

class WatchTest : public ::testing::Test {
 protected:
  WatchOptions options() {
    WatchOptions options;
    options.record = record_;
    options.darken = [this](const GuardedMachine& machine) -> Status {
      const std::lock_guard lock(mutex_);
      darkened_.push_back(to_text(machine));
      if (static_cast<int>(darkened_.size()) <= fails_) return Error{ErrorCode::kUnavailable, "it is unplugged"};
      return Ok();
    };
    options.tries = 3;
    options.pause = std::chrono::milliseconds(0);
    return options;
  }
  std::vector<std::string> darkened() {
    const std::lock_guard lock(mutex_);
    return darkened_;
  }
  bool recorded() const { return std::filesystem::exists(record_); }
  std::string record() const {
    std::ifstream in(record_);
    std::string line;
    std::getline(in, line);
    return line;
  }
  void leave_behind(const GuardedMachine& machine) const { std::ofstream(record_) << to_text(machine) << "\n"; }

  testing::TempDirectory folder_;
  std::filesystem::path record_ = folder_ / "guarded";
  std::mutex mutex_;
  std::vector<std::string> darkened_;
  int fails_ = 0;
};

TEST_F(WatchTest, DarkensTheMachineOfADaemonThatDies) {
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  EXPECT_TRUE(recorded());
  EXPECT_THAT(darkened(), IsEmpty());
  daemon.dies();
  daemon.await_guardian();
  EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine)));
  EXPECT_EQ(record(), "dark " + to_text(kMachine));
}

// Nobody knows who had hands on it since: once more, before the next daemon's first Reset, whatever it guards.
TEST_F(WatchTest, DarkensOnceMoreBeforeTheNextDaemonIsServed) {
  {
    Daemon daemon(options());
    daemon.say("watch " + to_text(kMachine));
    EXPECT_EQ(daemon.hear(), "ready");
  }
  EXPECT_TRUE(Watch(options(), make_null_logger()).settle().ok());
  EXPECT_EQ(darkened().size(), 1U) << "it is dark";
  {
    Daemon next(options());
    next.say("watch grbl tcp:192.0.2.1:23");
    EXPECT_EQ(next.hear(), "ready");
    EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine), to_text(kMachine)));
    next.say("done");
  }
  EXPECT_FALSE(recorded());
}

TEST_F(WatchTest, AMachineThatWasDarkenedAndIsSwitchedOffSinceWorriesNobody) {
  std::ofstream(record_) << "dark " << to_text(kMachine) << "\n";
  fails_ = 1;
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  daemon.say("done");
}

TEST_F(WatchTest, AnswersWhoAsksWhetherItIsThere) {
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  for (int i = 0; i < 3; ++i) {
    daemon.say("ping");
    EXPECT_EQ(daemon.hear(), "pong");
  }
  daemon.say("done");
}

TEST_F(WatchTest, LeavesTheMachineOfADaemonThatEndedInOrderAlone) {
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  daemon.say("done");
  daemon.dies();
  daemon.await_guardian();
  EXPECT_THAT(darkened(), IsEmpty());
  EXPECT_FALSE(recorded());
}

TEST_F(WatchTest, TriesAgainUntilTheMachineIsThere) {
  fails_ = 2;
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  daemon.dies();
  daemon.await_guardian();
  EXPECT_EQ(darkened().size(), 3U);
  EXPECT_EQ(record(), "dark " + to_text(kMachine));
}

TEST_F(WatchTest, WhatItCouldNotReachIsDarkenedBeforeTheNextDaemonIsServed) {
  fails_ = 3;
  {
    Daemon daemon(options());
    daemon.say("watch " + to_text(kMachine));
    EXPECT_EQ(daemon.hear(), "ready");
  }
  EXPECT_TRUE(recorded());
  darkened_.clear(), fails_ = 0;
  Daemon next(options());
  next.say("watch grbl tcp:192.0.2.1:23");
  EXPECT_EQ(next.hear(), "ready");
  EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine)));
  next.say("done");
}

// The daemon waits, so that nobody can say Reset before it is dark.
TEST_F(WatchTest, TellsWhatWasLeftBehindAndCannotBeReachedAndTriesUntilItCan) {
  leave_behind(kMachine);
  fails_ = 7;  // more than it tries after a death
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "left it is unplugged");
  EXPECT_EQ(daemon.hear(), "ready");
  EXPECT_EQ(darkened().size(), 8U);
  daemon.say("done");
}

TEST_F(WatchTest, GivesUpWhatWasLeftBehindAtAnotherPortAndSaysSo) {
  leave_behind(kMachine);
  fails_ = 100;
  Daemon daemon(options());
  daemon.say("watch grbl tcp:192.0.2.1:23");
  EXPECT_EQ(daemon.hear(), "left it is unplugged");
  EXPECT_EQ(daemon.hear(), "ready it is unplugged");
  EXPECT_EQ(darkened().size(), 3U);
  daemon.say("done");
}

TEST_F(WatchTest, ADaemonThatEndsWhileItWaitsLeavesTheRecordToTheNext) {
  leave_behind(kMachine);
  fails_ = 1000000000;
  Daemon daemon(options());
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "left it is unplugged");
  daemon.dies();
  daemon.await_guardian();
  EXPECT_EQ(record(), to_text(kMachine));
}

TEST_F(WatchTest, TouchesNothingWhenItComesBackToADaemonThatLives) {
  leave_behind(kMachine);
  Daemon daemon(options());
  daemon.say("again " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  EXPECT_THAT(darkened(), IsEmpty());
  daemon.dies();
  daemon.await_guardian();
  EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine)));
}

TEST_F(WatchTest, ASecondDaemonHasToWaitAndTouchesNothingWhenItGivesUp) {
  Daemon first(options());
  first.say("watch " + to_text(kMachine));
  EXPECT_EQ(first.hear(), "ready");
  {
    Daemon second(options());
    second.say("watch " + to_text(kMachine));
  }
  EXPECT_THAT(darkened(), IsEmpty());
  EXPECT_TRUE(recorded());
  first.say("done");
}

TEST_F(WatchTest, ANewDaemonIsReadyOnceItsPredecessorsMachineIsDark) {
  const int lock = open((record_.string() + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(flock(lock, LOCK_EX), 0);  // its guardian is still at it
  Daemon next(options());
  next.say("watch " + to_text(kMachine));
  leave_behind(kMachine);
  close(lock);
  EXPECT_EQ(next.hear(), "ready");
  EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine)));
  next.say("done");
}

TEST_F(WatchTest, SettlesWhatARecordSaysAndNothingElse) {
  Watch watch(options(), make_null_logger());
  EXPECT_TRUE(watch.settle().ok());
  EXPECT_THAT(darkened(), IsEmpty());
  leave_behind({"lihuiyu", "usb:1a86:5512"});
  EXPECT_TRUE(watch.settle().ok());
  EXPECT_THAT(darkened(), ElementsAre("lihuiyu usb:1a86:5512"));
  EXPECT_EQ(record(), "dark lihuiyu usb:1a86:5512");
  fails_ = 2;
  leave_behind(kMachine);
  EXPECT_EQ(watch.settle().error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(recorded());
}

TEST_F(WatchTest, StrangersAreShownTheDoor) {
  for (const char* line : {"hello", "watch", "watch toaster serial:/dev/ttyUSB0", "done", ""}) {
    Daemon stranger(options());
    stranger.say(line);
    EXPECT_EQ(stranger.hear(), "") << line;
  }
  EXPECT_THAT(darkened(), IsEmpty());
  EXPECT_FALSE(recorded());
}

TEST_F(WatchTest, OtherUsersAreShownTheDoor) {
  WatchOptions of_another = options();
  of_another.daemon = ::geteuid() + 1;
  Daemon stranger(of_another);
  EXPECT_EQ(stranger.hear(), "") << "before a word was said";
  EXPECT_FALSE(recorded());
}

TEST_F(WatchTest, WhoeverSaysNothingIsShownTheDoorAndTheDaemonThatSpokeIsNot) {
  WatchOptions impatient = options();
  impatient.first_line = std::chrono::milliseconds(20);
  Daemon silent(impatient);
  EXPECT_EQ(silent.hear(), "");
  Daemon slow(impatient);
  slow.say_part("watch ");
  EXPECT_EQ(slow.hear(), "");
  impatient.first_line = std::chrono::milliseconds(2000);
  Daemon daemon(impatient);
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  daemon.say("done");
}

TEST_F(WatchTest, ADiskThatIsFullDoesNotKeepTheMachineFromBeingDarkened) {
  WatchOptions full = options();
  std::ofstream(folder_ / "file") << "in the way";
  full.record = folder_ / "file/guarded";
  Daemon daemon(full);
  daemon.say("watch " + to_text(kMachine));
  EXPECT_EQ(daemon.hear(), "ready");
  daemon.dies();
  daemon.await_guardian();
  EXPECT_THAT(darkened(), ElementsAre(to_text(kMachine)));
}

}  // namespace
}  // namespace veneer::guardian
