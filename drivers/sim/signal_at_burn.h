// Sends a signal to a process or a text to a Unix socket, or fills a process's disk, in the middle of a stroke: the
// first time the beam is on and has burnt so much. How tests kill or stop a daemon, or act, at the same place of a cut
// however fast their machine is. Happens once.
//
// Threading: called on the reactor.
#pragma once

#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <string>

namespace veneer::sim {

class SignalAtBurn {
 public:
  struct Order {
    pid_t pid = 0;
    int number = SIGKILL;
    double burnt_mm = 0;      // as the machine's watchdog counts it
    std::string socket = {};  // gets `text`, instead of a signal to a process
    std::string text = {};
    bool fills_disk = false;  // instead of the signal: no file that the process writes may grow any more
  };
  SignalAtBurn() = default;
  SignalAtBurn(const SignalAtBurn&) = delete;
  SignalAtBurn& operator=(const SignalAtBurn&) = delete;
  ~SignalAtBurn() { hang_up(); }

  void arm(const Order& order) { order_ = order; }
  void look(bool beam_on, double burnt_mm) {
    if (!order_ || !beam_on || burnt_mm < order_->burnt_mm) return;
    if (order_->fills_disk)
      fill_disk(order_->pid);
    else if (order_->socket.empty())
      kill(order_->pid, order_->number);
    else
      send(order_->socket, order_->text);
    order_.reset();
  }

 private:
  // Whoever may do this to it may take it back as well: the hard limit stays.
  static void fill_disk(pid_t pid) {
    rlimit limit{};
    if (::prlimit(pid, RLIMIT_FSIZE, nullptr, &limit) != 0) return;
    limit.rlim_cur = 0;
    ::prlimit(pid, RLIMIT_FSIZE, &limit, nullptr);
  }
  void send(const std::string& path, const std::string& text) {
    hang_up();
    socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy_n(path.begin(), std::min(path.size(), sizeof address.sun_path - 1), &address.sun_path[0]);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
      static_cast<void>(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) < 0);
  }
  void hang_up() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  std::optional<Order> order_;
  int socket_ = -1;  // of the last text: open, so that whoever answers has somebody to answer
};

}  // namespace veneer::sim
