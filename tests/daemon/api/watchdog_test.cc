#include "daemon/api/watchdog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/hand_timer.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using testing::HandTimer;

struct NoteBook final : ServiceNotifier {
  void notify(const std::string& note) override { notes.push_back(note); }
  Duration watchdog_period() const override { return period; }
  std::vector<std::string> notes;
  Duration period = seconds(8);
};

class WatchdogTest : public ::testing::Test {
 protected:
  NoteBook book_;
  HandTimer* timer_ = nullptr;
  Watchdog watchdog_{book_, std::make_unique<HandTimer>(&timer_)};
};

TEST_F(WatchdogTest, IsFedAtAQuarterOfItsPeriodFromReadyOn) {
  EXPECT_FALSE(timer_->pending);
  watchdog_.ready();
  EXPECT_EQ(timer_->wait, seconds(2));
  timer_->fire();
  EXPECT_THAT(book_.notes, ElementsAre("READY=1", "WATCHDOG=1", "WATCHDOG=1"));
}

TEST(Repeater, DoesTheSameAPeriodAfterEachTime) {
  HandTimer* timer = nullptr;
  int done = 0;
  Repeater repeater(std::make_unique<HandTimer>(&timer), seconds(1), [&] { ++done; });
  EXPECT_FALSE(timer->pending);
  repeater.begin();
  EXPECT_EQ(timer->wait, seconds(1));
  EXPECT_EQ(done, 0);
  timer->fire();
  timer->fire();
  EXPECT_EQ(done, 2);
  EXPECT_TRUE(timer->pending);
}

TEST_F(WatchdogTest, NothingIsFedWhenNobodyWatches) {
  book_.period = Duration(0);
  watchdog_.ready();
  EXPECT_FALSE(timer_->pending);
  EXPECT_THAT(book_.notes, ElementsAre("READY=1"));
}

TEST_F(WatchdogTest, TheStatusIsOneLineToldOnce) {
  watchdog_.status("Execute: piece A3-12\nWATCHDOG=trigger");
  watchdog_.status("Execute: piece A3-12\nWATCHDOG=trigger");
  watchdog_.stopping();
  EXPECT_THAT(book_.notes, ElementsAre("STATUS=Execute: piece A3-12 WATCHDOG=trigger", "STOPPING=1"));
}

TEST(SystemdNotifier, SpeaksToTheManagersSocketAndKnowsItsPeriod) {
  const testing::TempDirectory folder;
  const std::string path = (folder / "notify").string();
  const int manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(manager, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  setenv("NOTIFY_SOCKET", path.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
  setenv("WATCHDOG_USEC", "20000000", 1);    // NOLINT(concurrency-mt-unsafe)

  SystemdNotifier notifier;
  EXPECT_EQ(notifier.watchdog_period(), seconds(20));
  notifier.notify("READY=1");
  std::string got(64, '\0');
  got.resize(static_cast<std::size_t>(recv(manager, got.data(), got.size(), 0)));
  EXPECT_EQ(got, "READY=1");

  unsetenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe)
  unsetenv("WATCHDOG_USEC");  // NOLINT(concurrency-mt-unsafe)
  SystemdNotifier nobody;
  EXPECT_EQ(nobody.watchdog_period(), Duration(0));
  nobody.notify("READY=1");
  close(manager);
}

// What a shell under a service, or a container, hands down is not meant for this process.
TEST(SystemdNotifier, KnowsWhetherSystemdItselfBeganTheProcess) {
  const auto begun = [](const char* unit, const std::string& process) {
    // NOLINTBEGIN(concurrency-mt-unsafe): one thread
    unit ? setenv("INVOCATION_ID", unit, 1) : unsetenv("INVOCATION_ID");
    process.empty() ? unsetenv("SYSTEMD_EXEC_PID") : setenv("SYSTEMD_EXEC_PID", process.c_str(), 1);
    const bool own = is_systemds_own();
    unsetenv("INVOCATION_ID");
    unsetenv("SYSTEMD_EXEC_PID");
    // NOLINTEND(concurrency-mt-unsafe)
    return own;
  };
  EXPECT_FALSE(begun(nullptr, ""));
  EXPECT_FALSE(begun("4f1e", ""));
  EXPECT_FALSE(begun("4f1e", std::to_string(getppid()))) << "a child of what systemd began";
  EXPECT_FALSE(begun(nullptr, std::to_string(getpid())));
  EXPECT_TRUE(begun("4f1e", std::to_string(getpid())));
}

}  // namespace
}  // namespace veneer::daemon
