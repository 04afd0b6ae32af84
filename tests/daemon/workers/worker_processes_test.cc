// Whatever a worker process does, it costs its task alone; and what it may not do, it cannot.
#include "daemon/workers/worker_processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "base/files.h"
#include "base/sanitized.h"
#include "daemon/workers/confinement.h"
#include "daemon/workers/work_folder.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A pseudo-terminal, as the simulated laser's port is.
class Terminal {
 public:
  Terminal() : fd_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    ::grantpt(fd_);
    ::unlockpt(fd_);
  }
  ~Terminal() { ::close(fd_); }
  std::string path() const {
    std::string name(64, '\0');
    ::ptsname_r(fd_, name.data(), name.size());
    return name.c_str();
  }

 private:
  int fd_;
};

class WorkerProcessesTest : public ::testing::Test {
 protected:
  WorkOrder order(const std::string& kind, json request = json::object()) {
    WorkOrder out;
    out.kind = kind;
    out.what = "planning";
    out.request = std::move(request);
    out.folder = folder_.path();
    out.deadline = std::chrono::seconds(60);
    return out;
  }
  static WorkerProcesses processes(std::uint64_t memory_bytes = 0, std::function<void(pid_t)> on_start = {}) {
    return WorkerProcesses({VENEER_TEST_WORKER, memory_bytes, std::move(on_start)}, make_null_logger());
  }
  Result<json> run(const WorkOrder& work) { return processes().run(work, {}, {}); }
  // What became of the attempt to open a file, as errno.
  int opened(const std::string& path, int flags, const WorkOrder& with) {
    WorkOrder attempt = with;
    attempt.kind = "open";
    attempt.request = {{"path", path}, {"flags", flags}};
    auto result = run(attempt);
    EXPECT_TRUE(result.ok()) << result.error().message;
    return result ? result->at("errno").get<int>() : -1;
  }

  testing::TempDirectory folder_;
};

TEST_F(WorkerProcessesTest, DoWhatIsAskedAndTellHowFarTheyAre) {
  json request{{"text", std::string(3'000'000, 'a')}};  // far more than a pipe holds
  std::vector<std::string> told;
  auto result = processes().run(order("echo", request),
                                [&](double fraction, const std::string& text) {
                                  told.push_back(text);
                                  EXPECT_DOUBLE_EQ(fraction, 0.5);
                                },
                                {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(*result, request);
  EXPECT_THAT(told, ElementsAre("half of it"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "made"));
}

// An update may replace this program while the daemon of before still runs.
TEST_F(WorkerProcessesTest, AnOrderThatSaysNothingOfTheNetworkIsDone) {
  const std::filesystem::path answers = folder_ / "answers";
  json asked{{"what", "planning"}, {"kind", "echo"}, {"request", {{"text", "a"}}}, {"folder", folder_.path().string()},
             {"memory_bytes", 0},  {"nice", 0},      {"readable", json::array()},  {"writable", json::array()}};
  std::ofstream(folder_ / "order") << asked.dump() << "\n";
  ASSERT_EQ(::mkfifo((folder_ / "requests").c_str(), 0600), 0);
  // Open both ways, so that it has a writer for as long as the worker reads.
  const std::string command = fmt::format("cd '{}' && exec 4<>requests && cat order >&4 && exec '{}' <&4 3>answers",
                                          folder_.path().string(), VENEER_TEST_WORKER);
  EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(concurrency-mt-unsafe): the C library's is
  const std::string said = read_whole(answers).value_or("");
  EXPECT_THAT(said, HasSubstr("{\"done\":{\"text\":\"a\"}}"));
}

TEST_F(WorkerProcessesTest, PassOnTheirErrors) {
  auto result = run(order("refuse"));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kRefused);
  EXPECT_EQ(result.error().message, "no wood was left: add a panel");
}

TEST_F(WorkerProcessesTest, CostTheirTaskWhenTheyThrowCrashOrLeave) {
  EXPECT_THAT(run(order("throw")).error().message, HasSubstr("a library's assertion"));
  const auto crashed = run(order("crash"));
  EXPECT_EQ(crashed.error().code, ErrorCode::kInternal);
  EXPECT_THAT(crashed.error().message, AllOf(HasSubstr("planning was broken off"), HasSubstr("signal 6")));
  EXPECT_THAT(run(order("leave")).error().message, HasSubstr("ended with status 7"));
}

TEST_F(WorkerProcessesTest, CostTheirTaskWhenTheyTalkNonsense) {
  for (const char* said : {"what?\n", "{}\n", "[1]\n", "{\"progress\":\"x\",\"text\":1}\n", "{\"error\":3}\n",
                           "{\"error\":{\"code\":1}}\n", "\xff\xfe\n", "\n"}) {
    const auto result = run(order("nonsense", said));
    ASSERT_FALSE(result.ok()) << said;
    EXPECT_EQ(result.error().code, ErrorCode::kInternal);
    EXPECT_THAT(result.error().message, HasSubstr("nonsense")) << said;
  }
  EXPECT_THAT(run(order("flood")).error().message, HasSubstr("nonsense"));
}

TEST_F(WorkerProcessesTest, CostTheirTaskWhenTheyAreKilled) {
  const auto result = processes(0, [](pid_t pid) { ::kill(pid, SIGKILL); }).run(order("hang"), {}, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(result.error().message, HasSubstr("killed"));
}

// Before it has read what it is to do: writing to it must not kill the writer.
TEST_F(WorkerProcessesTest, CostTheirTaskWhenTheyAreKilledBeforeTheyRead) {
  const auto kill_and_see_it_gone = [](pid_t pid) {
    ::kill(pid, SIGKILL);
    siginfo_t how{};
    EXPECT_EQ(::waitid(P_PID, static_cast<id_t>(pid), &how, WEXITED | WNOWAIT), 0);
  };
  const auto result = processes(0, kill_and_see_it_gone).run(order("hang"), {}, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(result.error().message, HasSubstr("killed"));
}

TEST_F(WorkerProcessesTest, AreEndedAtTheirDeadline) {
  WorkOrder slow = order("hang");
  slow.deadline = std::chrono::milliseconds(300);
  const auto result = run(slow);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(result.error().message, HasSubstr("took longer than 0.3 s"));
  // Stopped by a signal they are ended all the same.
  const auto stopped = processes(0, [](pid_t pid) { ::kill(pid, SIGSTOP); }).run(slow, {}, {});
  EXPECT_EQ(stopped.error().code, ErrorCode::kTimeout);
}

TEST_F(WorkerProcessesTest, AreEndedWhenTheirTaskIsCancelled) {
  std::stop_source stop;
  pid_t pid = 0;
  const auto result =
      processes(0, [&](pid_t p) { pid = p; })
          .run(
              order("hang"), [&](double, const std::string&) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(::kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
  EXPECT_EQ(processes().run(order("hang"), {}, stop.get_token()).error().code, ErrorCode::kCancelled);
}

// A scanner that is killed in the midst keeps its carriage out.
TEST_F(WorkerProcessesTest, MayEndInOrderWhenTheyAreGivenTime) {
  WorkOrder work = order("wait to be told");
  work.grace = std::chrono::seconds(60);
  std::stop_source stop;
  const auto cancelled = processes().run(
      work, [&](double, const std::string&) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(cancelled.error().message, "planning was cancelled");
  EXPECT_TRUE(std::filesystem::remove(folder_ / "ended in order"));
  // Before it has begun as well.
  EXPECT_EQ(processes().run(work, {}, stop.get_token()).error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(std::filesystem::remove(folder_ / "ended in order"));

  work.deadline = std::chrono::milliseconds(300);
  const auto late = run(work);
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, ErrorCode::kTimeout);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "ended in order"));
}

TEST_F(WorkerProcessesTest, AreKilledWhenTheyDoNotEndInOrder) {
  WorkOrder work = order("hang");
  work.deadline = work.grace = std::chrono::milliseconds(200);
  pid_t pid = 0;
  const auto late = processes(0, [&](pid_t p) { pid = p; }).run(work, {}, {});
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(::kill(pid, 0), -1);
  work.deadline = std::chrono::seconds(60);
  std::stop_source stop;
  const auto cancelled = processes().run(
      work, [&](double, const std::string&) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);
}

// RLIMIT_FSIZE is for each file: many small ones fill a disk as well.
TEST_F(WorkerProcessesTest, AreEndedBeforeTheyFillTheDisk) {
  constexpr std::uint64_t kFree = 1 << 30;
  for (const std::uint64_t before : {kFree, std::uint64_t{1000}}) {
    int asked = 0;
    WorkerProcessOptions options{VENEER_TEST_WORKER, 0, {}};
    options.free_space = [&](const std::filesystem::path& folder) {
      EXPECT_EQ(folder, folder_.path());
      return ++asked == 1 ? before : std::min(before / 2, std::uint64_t{256 << 20}) - 1;
    };
    const auto result = WorkerProcesses(options, make_null_logger()).run(order("hang"), {}, {});
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::kStorage);
    EXPECT_THAT(result.error().message, HasSubstr("the disk is nearly full"));
  }
}

TEST_F(WorkerProcessesTest, TakeNoMoreMemoryThanTheyMay) {
#ifdef VENEER_SANITIZED
  GTEST_SKIP() << "sanitizers need memory without limits";
#endif
  const auto result = processes(256 << 20).run(order("hog"), {}, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(result.error().message, AllOf(HasSubstr("more memory than the 256 MB"), HasSubstr("memory_mb")));
}

TEST_F(WorkerProcessesTest, CannotOpenTheLasersPort) {
  const Terminal laser;
  const auto link = folder_ / "laser";
  std::filesystem::create_symlink(laser.path(), link);
  const testing::TempDirectory mine, data;
  WorkOrder work = order("open");
  work.folder = mine.path();
  work.readable = {data.path(), folder_.path()};  // even where a link to it may be read
  for (const std::string& path : {laser.path(), link.string(), std::string("/dev/ptmx"), std::string("/dev/tty")})
    for (const int flags : {O_RDONLY, O_WRONLY, O_RDWR}) {
      const int failed = opened(path, flags | O_NOCTTY | O_NONBLOCK, work);
      EXPECT_EQ(failed, EACCES) << path;
    }
}

TEST_F(WorkerProcessesTest, ReadWhatTheyWereGivenAndWriteInTheirFolderOnly) {
  const testing::TempDirectory mine, data, other;
  std::ofstream(data / "map.png") << "x";
  std::ofstream(other / "secret") << "x";
  WorkOrder work = order("open");
  work.folder = mine.path();
  work.readable = {data.path()};
  EXPECT_EQ(opened(data / "map.png", O_RDONLY, work), 0);
  EXPECT_EQ(opened(data / "map.png", O_WRONLY, work), EACCES);
  EXPECT_EQ(opened(data / "map.png", O_RDONLY | O_TRUNC, work), EPERM);
  EXPECT_EQ(opened(data / "map.png", O_ACCMODE | O_TRUNC, work), EPERM);
  EXPECT_EQ(std::filesystem::file_size(data / "map.png"), 1U);
  EXPECT_EQ(opened(data / "new", O_WRONLY | O_CREAT, work), EACCES);
  EXPECT_EQ(opened(other / "secret", O_RDONLY, work), EACCES);
  EXPECT_EQ(opened("/etc/passwd", O_RDONLY, work), EACCES);
  EXPECT_EQ(opened(mine / "new", O_WRONLY | O_CREAT | O_TRUNC, work), 0);
  EXPECT_EQ(opened(mine / "new", O_RDWR, work), 0);
}

TEST_F(WorkerProcessesTest, ChangeNothingOfFilesAndProcessesThatAreNotTheirs) {
  const testing::TempDirectory data;
  std::ofstream(data / "veneerd.db") << "wood";
  WorkOrder work = order("meddle", {{"path", (data / "veneerd.db").string()}});
  work.readable = {data.path()};
  const auto result = run(work);
  ASSERT_TRUE(result.ok()) << result.error().message;
  for (const auto& [call, failed] : result->items()) EXPECT_EQ(failed, EPERM) << call;
  EXPECT_EQ(result->size(), 5U);
  EXPECT_EQ(std::filesystem::file_size(data / "veneerd.db"), 4U);
}

TEST_F(WorkerProcessesTest, CostTheirTaskWhenTheyNestWithoutEnd) {
  EXPECT_THAT(run(order("nest")).error().message, HasSubstr("nonsense"));
}

TEST_F(WorkerProcessesTest, ReachNoSocketAndNoOtherProcessAndInheritNothing) {
  const int inheritable = ::fcntl(STDERR_FILENO, F_DUPFD, 20);  // somebody forgot O_CLOEXEC
  ASSERT_GE(inheritable, 20);
  WorkOrder reach = order("reach");
  reach.nice = 7;
  const auto result = run(reach);
  ::close(inheritable);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->at("socket"), EPERM);
  EXPECT_EQ(result->at("kill parent"), EPERM);
  EXPECT_EQ(result->at("fork"), EPERM);
  EXPECT_EQ(result->at("device node"), EPERM);
  EXPECT_EQ(result->at("thread"), 0);
  EXPECT_EQ(result->at("descriptors"), (json{0, 1, 2, 3}));
  EXPECT_EQ(result->at("oom_score_adj"), 1000);
  EXPECT_EQ(result->at("nice"), 7);
}

TEST_F(WorkerProcessesTest, ThatScanReachTheirDevicesAndTheNetworkButNoUnixSocketAndNotTheLaser) {
  const Terminal scanner, laser;
  WorkOrder reach = order("reach out", {{"given", scanner.path()}, {"kept", laser.path()}});
  reach.devices = {scanner.path()};
  reach.network = true;
  const auto result = run(reach);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->at("given"), 0);
  EXPECT_EQ(result->at("kept"), EACCES);
  for (const char* family : {"internet", "internet 6", "netlink"})
    EXPECT_THAT(result->at(family).get<int>(), ::testing::AnyOf(0, EAFNOSUPPORT)) << family;
  EXPECT_EQ(result->at("ioctl"), 0);
  EXPECT_EQ(result->at("type"), ENOTTY) << "into the daemon's terminal";
  for (const char* denied : {"unix", "packet", "bluetooth", "fork"}) EXPECT_EQ(result->at(denied), EPERM) << denied;
}

TEST_F(WorkerProcessesTest, ThatLookThroughACameraReachThatDeviceAndNothingElse) {
  const Terminal camera, laser;
  WorkOrder reach = order("reach out", {{"given", camera.path()}, {"kept", laser.path()}});
  reach.devices = {camera.path()};
  const auto result = run(reach);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->at("given"), 0);
  EXPECT_EQ(result->at("kept"), EACCES);
  EXPECT_EQ(result->at("type"), ENOTTY) << "into the daemon's terminal";
  for (const char* denied : {"internet", "internet 6", "netlink", "unix", "packet", "bluetooth", "fork"})
    EXPECT_EQ(result->at(denied), EPERM) << denied;
}

// Whoever may not use a device is told which group to join.
TEST_F(WorkerProcessesTest, ThatHaveDevicesCanNameTheirGroups) {
  WorkOrder name = order("name group", 0);
  EXPECT_EQ(run(name).value(), "") << "which is nobody else's business";
  name.devices.emplace();
  EXPECT_EQ(run(name).value(), "root");
}

// A network without a list of devices would be one without what keeps it from the daemon's socket.
TEST_F(WorkerProcessesTest, HaveNoNetworkThatIsNotOrderedWithTheirDevices) {
  WorkOrder reach = order("reach out", {{"given", "/dev/null"}, {"kept", "/dev/null"}});
  reach.network = true;
  const auto result = run(reach);
  ASSERT_TRUE(result.ok()) << result.error().message;
  for (const char* denied : {"internet", "internet 6", "netlink", "unix"})
    EXPECT_EQ(result->at(denied), EPERM) << denied;
}

// On a kernel without Landlock.
TEST_F(WorkerProcessesTest, SeeNoDevicesWhereDevicesCanOnlyBeHidden) {
  const Terminal laser;
  const std::string path = laser.path();
  const pid_t child = ::fork();
  if (child == 0) {
    Confinement limits;
    limits.without_landlock = true;
    if (const Status confined = confine(limits); !confined) ::_exit(77);
    ::_exit(::open(path.c_str(), O_RDWR | O_NOCTTY) < 0 && errno == ENOENT ? 0 : 1);
  }
  int how = 0;
  ASSERT_EQ(::waitpid(child, &how, 0), child);
  if (WIFEXITED(how) && WEXITSTATUS(how) == 77) GTEST_SKIP() << "no namespaces here";
  EXPECT_EQ(how, 0);
}

// The daemon is killed: its workers go with it, whatever they were doing.
TEST_F(WorkerProcessesTest, DoNotOutliveWhoStartedThem) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // a child of a dead child becomes ours
  const WorkOrder work = order("hang");
  const pid_t daemon = ::fork();
  if (daemon == 0) {
    static_cast<void>(processes().run(work, [](double, const std::string&) { ::kill(::getpid(), SIGKILL); }, {}));
    ::_exit(1);
  }
  int how = 0;
  ASSERT_EQ(::waitpid(daemon, &how, 0), daemon);
  ASSERT_TRUE(WIFSIGNALED(how));
  pid_t worker = 0;
  std::ifstream(folder_ / "pid") >> worker;
  ASSERT_GT(worker, 0);
  ASSERT_EQ(::waitpid(worker, &how, 0), worker) << "which waits until it is gone";
  EXPECT_TRUE(WIFSIGNALED(how) || WIFEXITED(how));
  ::prctl(PR_SET_CHILD_SUBREAPER, 0);
}

TEST_F(WorkerProcessesTest, AreNamedWhenTheyAreMissing) {
  const auto result = WorkerProcesses({"/nowhere/veneer-worker", 0, {}}, make_null_logger()).run(order("echo"), {}, {});
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().message, HasSubstr("/nowhere/veneer-worker cannot be started"));
}

TEST(WorkFolder, IsGoneWithItsWorkAndAtTheNextStart) {
  const testing::TempDirectory data;
  std::filesystem::path one, left;
  {
    auto folder = WorkFolder::make(data.path());
    ASSERT_TRUE(folder.ok()) << folder.error().message;
    one = folder->path();
    std::ofstream(one / "x") << "y";
    WorkFolder moved = std::move(*folder);
    EXPECT_TRUE(std::filesystem::exists(one / "x"));
  }
  EXPECT_FALSE(std::filesystem::exists(one));
  left = data / "work" / "left";
  std::filesystem::create_directories(left);
  remove_left_work(data.path());
  EXPECT_FALSE(std::filesystem::exists(left));
}

}  // namespace
}  // namespace veneer::daemon
