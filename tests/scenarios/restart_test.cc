// A device that is chosen, the restart that takes it, and what a lost choice does to the next start: the daemon as the
// service manager has it.
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "base/files.h"
#include "cli/api_client.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

// What the service manager is told.
class Manager {
 public:
  explicit Manager(const fs::path& at) : path(at.string()), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Manager() { ::close(socket_); }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;
  std::string told() const {
    std::string all;
    for (std::string note(200, ' ');;) {
      const auto size = ::recv(socket_, note.data(), note.size(), MSG_DONTWAIT);
      if (size <= 0) return all;
      all += note.substr(0, static_cast<std::size_t>(size)) + ";";
    }
  }
  const std::string path;

 private:
  const int socket_;
};

class Restart : public ::testing::Test {
 protected:
  Restart() {
    std::ofstream(config_) << "[devices]\nchoose = true\n[sim]\nsocket = \"" << (dir_ / "t.sock").string()
                           << "\"\n[api]\nunix = \"" << (dir_ / "d.sock").string() << "\"\nlisten = \"\"\n[store]\n"
                           << "data_dir = \"" << data_.string() << "\"\n";
    fs::create_directories(data_);
  }
  // `by_systemd`: as its own process, which is told its number.
  static fs::path veneerd() {
    return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin" / "veneerd";
  }
  void start(const std::map<std::string, std::string>& environment, bool by_systemd = false) {
    std::vector<std::string> command = {veneerd().string(), "--config", config_.string()};
    if (by_systemd)
      command.insert(command.begin(), {"/bin/sh", "-c", "INVOCATION_ID=4f1e SYSTEMD_EXEC_PID=$$ exec \"$@\"", "sh"});
    auto started = ChildProcess::start(command, log_, environment);
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_.emplace(std::move(*started));
  }
  void until_it_answers() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!api_.get("/status") && daemon_->running() && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(api_.get("/status").ok()) << said();
  }
  std::string said() const { return read_whole(log_).value_or("no log"); }

  testing::TempDirectory dir_{testing::TempDirectory::Place::kDisk};
  const fs::path config_ = dir_ / "veneerd.toml", data_ = dir_ / "data", log_ = dir_ / "log";
  const fs::path chosen_ = data_ / "chosen_devices.toml";
  const cli::ApiClient api_{cli::ApiAddress{(dir_ / "d.sock").string(), "", 0}, std::chrono::seconds(60)};
  std::optional<ChildProcess> daemon_;
};

TEST_F(Restart, EndsInOrderAndComesBackWithWhatWasChosen) {
  const Manager manager(dir_ / "notify");
  start({{"NOTIFY_SOCKET", manager.path}}, true);
  until_it_answers();
  const auto backed_up = api_.post_and_wait("/backups");
  ASSERT_TRUE(backed_up.ok()) << backed_up.error().message;
  const auto backups = api_.get("/backups");
  ASSERT_TRUE(backups.ok()) << backups.error().message;
  const std::string backup = (*backups)["backups"].at(0)["folder"];
  const std::string picture = (data_ / "camera" / "bed.jpg").string();
  std::ofstream(picture) << "a picture";
  const auto kept = api_.post("/devices/camera", {{"kind", "file"}, {"device", picture}});
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  EXPECT_EQ((*kept)["restart_refused"], "");
  const auto restarting = api_.post("/restart");
  ASSERT_TRUE(restarting.ok()) << restarting.error().message;
  EXPECT_EQ(daemon_->wait(), 4) << "which the manager answers with a new start";
  EXPECT_THAT(manager.told(), HasSubstr("STOPPING=1")) << "as after SIGTERM";

  start({{"NOTIFY_SOCKET", manager.path}});
  until_it_answers();
  const auto devices = api_.get("/devices");
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  EXPECT_EQ((*devices)["camera"]["device"], picture);
  EXPECT_EQ((*devices)["camera"]["set_by"], "choice");
  EXPECT_THAT(said(), HasSubstr("camera: file " + picture + ", chosen"));
  const auto refused = api_.post("/restart");
  ASSERT_FALSE(refused.ok()) << "a socket may be anybody's";
  EXPECT_THAT(refused.error().message, HasSubstr("started by hand"));
  EXPECT_EQ(daemon_->terminate(), 0);

  const std::string whole = read_whole(chosen_).value_or("");
  fs::remove(chosen_);
  start({});
  until_it_answers();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  std::string alarms;
  while (alarms.find("holds no chosen_devices.toml") == std::string::npos && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (const auto told = api_.get("/alarms")) alarms = told->dump();
  }
  EXPECT_THAT(alarms, HasSubstr("holds no chosen_devices.toml"));
  EXPECT_EQ(daemon_->terminate(), 0);
  std::ofstream(chosen_) << whole;

  fs::resize_file(chosen_, fs::file_size(chosen_) / 2);
  start({});
  EXPECT_EQ(daemon_->wait(), 1) << "it is not another cell in silence";
  EXPECT_THAT(said(), AllOf(HasSubstr(chosen_.string() + " does not say which devices were chosen"),
                            HasSubstr("remove it and choose laser, scanner and camera again")));

  // Nor does it keep what was saved from coming back, which may be what mends it.
  const Finished restored = run_program({veneerd().string(), "--config", config_.string(), "--restore", backup});
  EXPECT_EQ(restored.status, 0) << restored.output;
  EXPECT_THAT(restored.output, HasSubstr("is in place in " + data_.string()));
}

}  // namespace
}  // namespace veneer::tests
