// Timers on the reactor, so that a test can put its own in their place.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>

#include "base/clock.h"

namespace veneer::daemon {

// Runs `then` once on the reactor, after `delay`; a later call replaces an earlier one.
class OneShotTimer {
 public:
  virtual ~OneShotTimer() = default;
  virtual void after(Duration delay, std::function<void()> then) = 0;
  virtual void cancel() = 0;
};
std::unique_ptr<OneShotTimer> make_reactor_timer(boost::asio::io_context& reactor);

// Does the same again and again, a period after each time it was done.
class Repeater {
 public:
  Repeater(std::unique_ptr<OneShotTimer> timer, Duration period, std::function<void()> act);
  void begin();  // for the first time after one period

 private:
  std::unique_ptr<OneShotTimer> timer_;
  Duration period_;
  std::function<void()> act_;
};

}  // namespace veneer::daemon
