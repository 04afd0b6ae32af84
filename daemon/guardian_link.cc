#include "daemon/guardian_link.h"

#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <csignal>
#include <thread>
#include <utility>

namespace veneer::daemon {

namespace asio = boost::asio;
using asio::local::stream_protocol;
using boost::system::error_code;
using std::chrono::milliseconds;
using RealClock = std::chrono::steady_clock;

GuardianLink::GuardianLink(asio::io_context& reactor, GuardianOptions options, Logger log,
                           std::function<void()> on_change)
    : options_(std::move(options)),
      log_(std::move(log)),
      on_change_(std::move(on_change)),
      socket_(reactor),
      again_(reactor),
      ping_(reactor),
      alive_(std::make_shared<int>(0)) {}

GuardianLink::~GuardianLink() {
  alive_.reset();
  error_code ignored;
  socket_.close(ignored);
  reap();
}

void GuardianLink::begin(milliseconds patience) {
  constexpr milliseconds kAgain{20};
  const auto end = RealClock::now() + patience;
  ask_whether_there();
  while (!ready_ && RealClock::now() < end) {
    if (!socket_.is_open() && !open()) {
      std::this_thread::sleep_for(kAgain);
      continue;
    }
    const auto left = std::chrono::ceil<milliseconds>(end - RealClock::now());
    pollfd answer{socket_.native_handle(), POLLIN, 0};
    if (::poll(&answer, 1, static_cast<int>(std::max(left, milliseconds(0)).count())) <= 0) break;
    error_code failed;
    const std::size_t size = asio::read_until(socket_, asio::dynamic_buffer(incoming_), '\n', failed);
    if (failed) {
      socket_.close(failed);
      continue;
    }
    take(incoming_.substr(0, size - 1));
    incoming_.erase(0, size);
  }
  if (socket_.is_open()) return listen();
  try_again();
}

bool GuardianLink::open() {
  error_code failed;
  if (options_.socket.empty()) {
    if (!start_one()) return false;
  } else {
    try {
      socket_.connect(stream_protocol::endpoint(options_.socket), failed);
    } catch (const boost::system::system_error& error) {  // a path that is too long
      failed = error.code();
    }
    if (failed) {
      socket_.close(failed);
      return false;
    }
  }
  const std::string line =
      std::string(watched_before_ ? "again " : "watch ") + guardian::to_text(options_.machine) + "\n";
  return ::send(socket_.native_handle(), line.data(), line.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(line.size());
}

bool GuardianLink::start_one() {
  reap();
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return false;
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  // Asio's sockets are not closed by themselves, and one that listens would go on listening after the daemon's death.
  ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  // A session of its own: whoever ends the daemon's group or its terminal does not end it.
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  std::string program = options_.program.string(), flag = "--record", record = options_.record.string(),
              mode = "--inherited";
  std::array<char*, 5> arguments{program.data(), flag.data(), record.data(), mode.data(), nullptr};
  const int failed = ::posix_spawn(&child_, program.c_str(), &actions, &attributes, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::posix_spawnattr_destroy(&attributes);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    child_ = 0;
    return false;
  }
  error_code ignored;
  socket_.assign(stream_protocol(), ends[0], ignored);
  return true;
}

void GuardianLink::reap() {
  if (child_ > 0 && ::waitpid(child_, nullptr, WNOHANG) != 0) child_ = 0;
}

void GuardianLink::listen() {
  asio::async_read_until(socket_, asio::dynamic_buffer(incoming_), '\n',
                         [this, alive = std::weak_ptr<int>(alive_)](const error_code& failed, std::size_t size) {
                           if (alive.expired()) return;
                           if (failed) return lost();
                           take(incoming_.substr(0, size - 1));
                           incoming_.erase(0, size);
                           listen();
                         });
}

void GuardianLink::take(const std::string& line) {
  if (line == "pong") {
    asked_.reset();
    if (ready_ || !watches_) return;
    log_->info("the guardian answers again");
    ready_ = true;
    if (on_change_) on_change_();
    return;
  }
  constexpr std::string_view kLeft = "left ", kReadyBut = "ready ";
  if (line.starts_with(kLeft)) {
    left_behind_ = true;
    log_->error("what the last run left behind is not dark yet, and nothing moves before it is: {}",
                line.substr(kLeft.size()));
    if (on_change_) on_change_();
    return;
  }
  if (!line.starts_with("ready")) return;
  watches_ = true;
  if (watched_before_) log_->info("the guardian is back");
  ready_ = watched_before_ = true;
  if (line.starts_with(kReadyBut))
    log_->error("what the last run left behind, at another port than the laser's of now, could not be darkened: {}",
                line.substr(kReadyBut.size()));
  else if (left_behind_)
    log_->info("what the last run left behind is dark");
  left_behind_ = false;
  if (on_change_) on_change_();
}

void GuardianLink::lost() {
  error_code ignored;
  socket_.close(ignored);
  incoming_.clear();
  watches_ = left_behind_ = false;
  asked_.reset();
  if (std::exchange(ready_, false)) {
    log_->error("the guardian is gone: no beam begins until it is back");
    if (on_change_) on_change_();
  }
  try_again();
}

void GuardianLink::try_again() {
  constexpr milliseconds kAgain{200};
  again_.expires_after(kAgain);
  again_.async_wait([this, alive = std::weak_ptr<int>(alive_)](const error_code& cancelled) {
    if (cancelled || alive.expired()) return;
    if (open()) return listen();
    error_code ignored;
    socket_.close(ignored);
    try_again();
  });
}

void GuardianLink::ask_whether_there() {
  ping_.expires_after(options_.ping);
  ping_.async_wait([this, alive = std::weak_ptr<int>(alive_)](const error_code& cancelled) {
    if (cancelled || alive.expired()) return;
    if (watches_ && !asked_) {
      static constexpr std::string_view kPing = "ping\n";
      static_cast<void>(::send(socket_.native_handle(), kPing.data(), kPing.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
      asked_ = RealClock::now();
    } else if (watches_ && ready_ && RealClock::now() - *asked_ >= options_.silence) {
      ready_ = false;
      log_->error("the guardian does not answer: no beam begins until one does");
      if (child_ > 0) ::kill(child_, SIGKILL);  // lost() starts another
      if (on_change_) on_change_();
    }
    ask_whether_there();
  });
}

Status GuardianLink::ready() const {
  if (ready_) return Ok();
  if (left_behind_)
    return Error{
        ErrorCode::kRefused,
        "the laser that the last run left behind is not known to be dark, and nothing moves before it is: look "
        "at it, and see that its cable is in and that it has power; the guardian tries again by itself"};
  if (watches_ && !options_.socket.empty())
    return Error{ErrorCode::kRefused,
                 "the guardian, which darkens the laser should the daemon die, hangs: restart veneer-guardian.service"};
  return Error{
      ErrorCode::kRefused,
      options_.socket.empty()
          ? "the guardian, which darkens the laser should the daemon die, does not watch yet: wait a moment; if that "
            "lasts, look whether " +
                options_.program.string() + " is there"
          : "the guardian, which darkens the laser should the daemon die, does not answer at " + options_.socket +
                ": start veneer-guardian.service"};
}

void GuardianLink::done() {
  ping_.cancel();
  if (!socket_.is_open()) return;
  static constexpr std::string_view kDone = "done\n";
  static_cast<void>(::send(socket_.native_handle(), kDone.data(), kDone.size(), MSG_NOSIGNAL));
}

}  // namespace veneer::daemon
