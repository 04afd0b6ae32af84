// Sends a signal to a process in the middle of a stroke: the first time the beam is on and has burnt so much. How tests
// kill a daemon, or act, at the same place of a cut however fast their machine is. Happens once.
//
// Threading: called on the reactor.
#pragma once

#include <signal.h>
#include <optional>

namespace veneer::sim {

class SignalAtBurn {
 public:
  struct Order {
    pid_t pid = 0;
    int number = SIGKILL;
    double burnt_mm = 0;  // as the machine's watchdog counts it
  };
  void arm(const Order& order) { order_ = order; }
  void look(bool beam_on, double burnt_mm) {
    if (!order_ || !beam_on || burnt_mm < order_->burnt_mm) return;
    kill(order_->pid, order_->number);
    order_.reset();
  }

 private:
  std::optional<Order> order_;
};

}  // namespace veneer::sim
