#include "guardian/watch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <span>
#include <thread>

#include "base/files.h"

namespace veneer::guardian {
namespace {

namespace fs = std::filesystem;

// Lines of the daemon; nothing at its end.
class Lines {
 public:
  explicit Lines(int descriptor) : descriptor_(descriptor) {}
  // `patience`: for the whole line; for ever without it.
  std::optional<std::string> next(const std::optional<std::chrono::milliseconds>& patience = {}) {
    const auto deadline = std::chrono::steady_clock::now() + patience.value_or(std::chrono::milliseconds(0));
    for (;;) {
      if (const auto end = heard_.find('\n'); end != std::string::npos) {
        std::string line = heard_.substr(0, end);
        heard_.erase(0, end + 1);
        return line;
      }
      if (patience) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
        pollfd something{descriptor_, POLLIN, 0};
        const int ready = left.count() > 0 ? ::poll(&something, 1, static_cast<int>(left.count())) : 0;
        if (ready == 0) return std::nullopt;
        if (ready < 0) continue;  // a signal
      }
      std::array<char, 512> chunk{};
      const ssize_t count = ::read(descriptor_, chunk.data(), chunk.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0 || heard_.size() > 4096) return std::nullopt;
      heard_.append(chunk.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  int descriptor_;
  std::string heard_;
};

void tell(int connection, std::string line) {
  line += '\n';
  static_cast<void>(::send(connection, line.data(), line.size(), MSG_NOSIGNAL));
}

// Connected, or made this pair of sockets.
bool is_of(int connection, uid_t user) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return ::getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == user;
}

bool hung_up(int connection, std::chrono::milliseconds wait) {
  pollfd end{connection, POLLRDHUP, 0};
  return ::poll(&end, 1, static_cast<int>(wait.count())) > 0;
}

constexpr std::string_view kDark = "dark ";  // before what a record names, once it was darkened

struct LeftBehind {
  GuardedMachine machine;
  bool dark = false;
};
std::optional<LeftBehind> kept(const fs::path& record) {
  std::ifstream in(record);
  std::string line;
  if (!std::getline(in, line)) return std::nullopt;
  const bool dark = line.starts_with(kDark);
  const auto machine = machine_from_text(std::string_view(line).substr(dark ? kDark.size() : 0));
  if (!machine) return std::nullopt;
  return LeftBehind{*machine, dark};
}

// Should it come back after a power cut, a machine is reset once too often.
void forget(const fs::path& record) { static_cast<void>(remove_durably(record)); }

}  // namespace

class Watch::Lock {
 public:
  explicit Lock(const fs::path& record)
      : file_(::open((record.string() + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640)) {}
  ~Lock() {
    if (file_ >= 0) ::close(file_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;
  // A lock that cannot be made (a folder that is gone) must not keep a machine from being darkened.
  bool take(bool wait) {
    return file_ < 0 || ::flock(file_, wait ? LOCK_EX : LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
  }

 private:
  int file_;
};

void Watch::serve(int connection) {
  if (!is_of(connection, options_.daemon)) return log_->warn("somebody who is not the daemon's user was refused");
  // Whoever says nothing keeps the guardian from the daemon that comes next.
  Lines lines(connection);
  const auto first = lines.next(options_.first_line);
  const auto space = first ? first->find(' ') : std::string::npos;
  const auto machine = space == std::string::npos ? std::nullopt : machine_from_text(first->substr(space + 1));
  const std::string word = first ? first->substr(0, space) : "";
  if (!machine || (word != "watch" && word != "again")) return;

  // Whoever holds the lock watches a daemon that lives, or darkens what one left. A daemon that ends meanwhile has
  // touched nothing.
  Lock lock(options_.record);
  while (!lock.take(false))
    if (hung_up(connection, std::chrono::milliseconds(50))) return;

  // What stands in the record is darkened before the daemon may touch it. One that is in another place than the machine
  // of now may be gone for good: that keeps nobody for ever.
  Status dark = Ok();
  if (word == "watch") {
    const auto left = kept(options_.record);
    const bool same = left && left->machine == *machine;
    for (int i = 0; !(dark = darken_left_behind(true)) && (same || i + 1 < options_.tries); ++i) {
      if (i == 0) tell(connection, "left " + dark.error().message);
      if (hung_up(connection, options_.pause)) return;  // the record stays for the next
    }
  }
  record(to_text(*machine));
  tell(connection, dark ? "ready" : "ready " + dark.error().message);

  while (const auto line = lines.next()) {
    if (*line == "done") return forget(options_.record);
    if (*line == "ping") tell(connection, "pong");
  }

  log_->warn("the daemon is dead: the machine on {} is darkened", machine->port);
  for (int i = 0; i < options_.tries; ++i) {
    if (i > 0) std::this_thread::sleep_for(options_.pause);
    if (dark = options_.darken(*machine); dark) {
      log_->info("the machine on {} is dark", machine->port);
      return record(std::string(kDark) + to_text(*machine));
    }
  }
  log_->error("the machine on {} could not be darkened: {}", machine->port, dark.error().message);
}

Status Watch::settle() {
  Lock lock(options_.record);
  lock.take(true);
  return darken_left_behind(false);
}

Status Watch::darken_left_behind(bool once_more) {
  const auto left = kept(options_.record);
  if (!left || (left->dark && !once_more)) return Ok();
  const Status dark = options_.darken(left->machine);
  if (dark && !left->dark) record(std::string(kDark) + to_text(left->machine));
  return left->dark ? Ok() : dark;  // one that was dark and is switched off since is no reason to worry anybody
}

void Watch::record(const std::string& line) const {
  const std::string text = line + "\n";
  if (const Status written = write_whole(options_.record, std::as_bytes(std::span(text))); !written)
    log_->warn("a guardian that dies as well leaves no word: {}", written.error().message);
}

}  // namespace veneer::guardian
