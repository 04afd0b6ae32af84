// A timer that a test's hand lets go off.
#pragma once

#include <functional>
#include <utility>

#include "daemon/threads/reactor_timer.h"

namespace veneer::testing {

struct HandTimer final : daemon::OneShotTimer {
  // `self`: where the test finds it once somebody else owns it.
  explicit HandTimer(HandTimer** self) { *self = this; }
  void after(Duration delay, std::function<void()> then) override {
    wait = delay;
    pending = std::move(then);
  }
  void cancel() override { pending = nullptr; }
  void fire() {
    const auto then = std::exchange(pending, nullptr);
    if (then) then();
  }
  Duration wait{0};
  std::function<void()> pending;
};

}  // namespace veneer::testing
