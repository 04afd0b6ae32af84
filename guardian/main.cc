// veneer-guardian: darkens the machine when the daemon dies. 0 = nothing is left to darken, 1 = it could not be
// darkened, 2 = unusable arguments.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "guardian/darken.h"
#include "guardian/watch.h"

namespace {

using namespace veneer;
using namespace veneer::guardian;

constexpr const char* kUsage =
    "usage: veneer-guardian --record FILE --listen SOCKET   watch one daemon after the other\n"
    "       veneer-guardian --record FILE --inherited       watch the daemon at the other end of standard input\n"
    "       veneer-guardian --record FILE --settle          darken what the last daemon left behind, and end\n";

// A socket that only this user and its group reach; nothing when it cannot be made.
int listen_at(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return -1;
  path.copy(address.sun_path, path.size());
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::unlink(path.c_str());
  ::umask(0007);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 && ::listen(listener, 8) == 0)
    return listener;
  ::close(listener);
  return -1;
}

int serve_all(Watch& watch, const std::string& path) {
  const int listener = listen_at(path);
  if (listener < 0) {
    std::fprintf(stderr, "veneer-guardian: cannot listen at %s: check its folder\n", path.c_str());
    return 1;
  }
  for (;;) {
    const int connection = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) {
      if (errno != EINTR && errno != ECONNABORTED) std::this_thread::sleep_for(std::chrono::milliseconds(100));
      continue;
    }
    watch.serve(connection);
    ::close(connection);
  }
}

// Whoever ends the daemon's group must not end its guardian first.
void outlive_the_daemon() {
  for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT}) std::signal(number, SIG_IGN);
}

}  // namespace

int main(int argc, char** argv) {
  std::string record, listen;
  bool inherited = false, settle = false;
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 1 && (words[0] == "--help" || words[0] == "-h")) {
    std::fputs(kUsage, stdout);
    return 0;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool more = i + 1 < words.size();
    if (words[i] == "--record" && more)
      record = words[++i];
    else if (words[i] == "--listen" && more)
      listen = words[++i];
    else if (words[i] == "--inherited")
      inherited = true;
    else if (words[i] == "--settle")
      settle = true;
    else
      record.clear(), i = words.size();
  }
  if (record.empty() || (listen.empty() ? 0 : 1) + (inherited ? 1 : 0) + (settle ? 1 : 0) != 1) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  const Logger log =
      make_stderr_logger("veneer-guardian", std::getenv("JOURNAL_STREAM") != nullptr);  // NOLINT(concurrency-mt-unsafe)
  std::signal(SIGPIPE, SIG_IGN);
  Watch watch({record, [](const GuardedMachine& machine) { return darken(machine); }}, log);
  if (settle) {
    const Status dark = watch.settle();
    if (!dark) log->error("{}", dark.error().message);
    return dark ? 0 : 1;
  }
  if (!listen.empty()) return serve_all(watch, listen);
  outlive_the_daemon();
  watch.serve(STDIN_FILENO);
  return 0;
}
