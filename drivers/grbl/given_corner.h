// Where the lower left corner is on a machine without homing switches: where an operator put the head once, in the
// controller's own count. The controller counts on through soft resets, but not through its own ones. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "drivers/grbl/reply.h"

namespace veneer::grbl {

class GivenCorner {
 public:
  // The place where the head stands becomes the corner: the first time, and when an operator has said so.
  bool to_be_taken() const { return state_ == State::kNeverGiven || here_; }
  void taken() { state_ = State::kKnown, here_ = false; }
  void operator_says_here() { here_ = true; }

  bool forgotten() const { return state_ == State::kForgotten; }
  // The controller was reset by somebody else, or is another one.
  void forget() {
    if (state_ == State::kKnown) state_ = State::kForgotten;
    before_reset_.reset();
  }

  // The driver resets the machine, whose head was here.
  void before_reset(const std::optional<StatusReport::Xy>& position) {
    if (position && state_ == State::kKnown) before_reset_ = position;
  }
  // Behind a reset the count should have gone on, by no more than the machine can have moved. One that has not, or that
  // stands at zero, has begun anew.
  void compare(const StatusReport::Xy& now, double most_mm) {
    const auto before = std::exchange(before_reset_, std::nullopt);
    if (!before || state_ != State::kKnown) return;
    const auto apart = [&](const StatusReport::Xy& p) {
      return std::max(std::abs(now[0] - p[0]), std::abs(now[1] - p[1]));
    };
    if (apart(*before) > most_mm || (apart({0, 0}) == 0 && apart(*before) > 0.01)) forget();
  }

 private:
  enum class State { kNeverGiven, kKnown, kForgotten };
  State state_ = State::kNeverGiven;
  bool here_ = false;
  std::optional<StatusReport::Xy> before_reset_;
};

}  // namespace veneer::grbl
