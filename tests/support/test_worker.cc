// A worker that misbehaves as it is told to.
#include <fcntl.h>
#include <grp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <fstream>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include "daemon/workers/work_server.h"

namespace {

using namespace veneer;
using namespace veneer::daemon;
using nlohmann::json;

void answer(const std::string& text) { static_cast<void>(!::write(kWorkAnswers, text.data(), text.size())); }

[[noreturn]] void hang() {
  for (;;) ::pause();
}

// Only as long as it is used: a compiler may drop what nobody reads.
volatile char sink = 0;

Result<json> work(const std::string& kind, const json& request, const std::filesystem::path& folder,
                  const TaskProgress& progress, const std::stop_token& stop) {
  if (kind == "echo") {
    progress(0.5, "half of it");
    std::ofstream(folder / "made") << request.dump();
    return request;
  }
  if (kind == "refuse") return Error{ErrorCode::kRefused, "no wood was left: add a panel"};
  if (kind == "throw") throw std::runtime_error("a library's assertion");
  if (kind == "hog") {
    std::vector<std::vector<char>> all;
    for (;;) {
      all.emplace_back(16 << 20, 'x');
      sink = all.back().back();
    }
  }
  if (kind == "crash") ::abort();
  if (kind == "leave") ::_exit(7);
  if (kind == "hang") {
    std::ofstream(folder / "pid.new") << ::getpid();
    std::filesystem::rename(folder / "pid.new", folder / "pid");
    progress(0.1, "begun");
    hang();
  }
  if (kind == "wait to be told") {
    progress(0.1, "begun");
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait(lock, stop, [] { return false; });
    std::ofstream(folder / "ended in order") << "x";
    return Error{ErrorCode::kCancelled, "what it says does not matter"};
  }
  if (kind == "nonsense") {
    answer(request.get<std::string>());
    hang();
  }
  if (kind == "flood") {
    for (const std::string chunk(1 << 16, 'x');;) answer(chunk);
  }
  if (kind == "open") {
    const auto path = request.at("path").get<std::string>();
    const int fd = ::open(path.c_str(), request.at("flags").get<int>() | O_CLOEXEC, 0600);
    return json{{"errno", fd < 0 ? errno : 0}};
  }
  if (kind == "meddle") {
    const auto path = request.at("path").get<std::string>();
    json out;
    const auto note = [&](const char* name, long result) { out[name] = result < 0 ? errno : 0; };
    note("truncate", ::truncate(path.c_str(), 0));
    note("chmod", ::chmod(path.c_str(), 0));
    note("chown", ::chown(path.c_str(), ::getuid(), ::getgid()));
    note("utimensat", ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0));
    note("setpriority", ::setpriority(PRIO_PROCESS, static_cast<id_t>(::getppid()), 19));
    return out;
  }
  if (kind == "nest") {
    std::string deep = "{\"done\":" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}\n";
    answer(deep);
    hang();
  }
  if (kind == "reach out") {
    json out;
    const auto note = [&](const char* name, long result) { out[name] = result < 0 ? errno : 0; };
    note("unix", ::socket(AF_UNIX, SOCK_STREAM, 0));
    note("packet", ::socket(AF_PACKET, SOCK_DGRAM, 0));
    note("bluetooth", ::socket(AF_BLUETOOTH, SOCK_STREAM, 0));
    note("internet", ::socket(AF_INET, SOCK_STREAM, 0));
    note("internet 6", ::socket(AF_INET6, SOCK_STREAM, 0));
    note("netlink", ::socket(AF_NETLINK, SOCK_RAW, 0));
    char typed = 'x';
    note("type", ::ioctl(STDERR_FILENO, TIOCSTI, &typed));
    int waiting = 0;
    note("ioctl", ::ioctl(::socket(AF_INET, SOCK_DGRAM, 0), FIONREAD, &waiting));
    note("given", ::open(request.at("given").get<std::string>().c_str(), O_RDWR | O_NOCTTY));
    note("kept", ::open(request.at("kept").get<std::string>().c_str(), O_RDWR | O_NOCTTY));
    note("fork", ::fork());
    return out;
  }
  if (kind == "name group") {
    std::array<char, 4096> room{};
    group entry{};
    group* found = nullptr;
    const bool told = ::getgrgid_r(request.get<gid_t>(), &entry, room.data(), room.size(), &found) == 0;
    return json(told && found != nullptr ? entry.gr_name : "");
  }
  if (kind == "reach") {
    json out;
    const auto note = [&](const char* name, long result) { out[name] = result < 0 ? errno : 0; };
    note("socket", ::socket(AF_UNIX, SOCK_STREAM, 0));
    note("kill parent", ::kill(::getppid(), 0));
    note("fork", ::fork());
    note("device node", ::mknod((folder / "null").c_str(), S_IFCHR | 0600, (1U << 8) | 3U));
    std::thread([&] { out["thread"] = 0; }).join();
    out["descriptors"] = json::array();
    for (int fd = 0; fd < 64; ++fd)
      if (::fcntl(fd, F_GETFD) >= 0) out["descriptors"].push_back(fd);
    std::ifstream score("/proc/self/oom_score_adj");
    int adjusted = 0;
    score >> adjusted;
    out["oom_score_adj"] = adjusted;
    out["nice"] = ::getpriority(PRIO_PROCESS, 0);
    return out;
  }
  return Error{ErrorCode::kNotFound, "no such kind of work"};
}

}  // namespace

int main() { serve_work(work); }
