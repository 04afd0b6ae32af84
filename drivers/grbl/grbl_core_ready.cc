// The part of GrblCore that gets a controller ready: phases, connecting, homing.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {
namespace {

constexpr char kSoftReset = '\x18';

}  // namespace

void GrblCore::enter(Phase phase) {
  phase_ = phase;
  phase_begin_ = now_;
  deadline_.reset();
  settled_at_.reset();
  idle_since_.reset();
  after_door_.reset();
  if (phase == Phase::kClosed) {
    poll_.reset();
    polls_lost_ = 0;
    silent_since_.reset();
    window_.clear();
    outstanding_.clear();
    last_report_.reset();
    run_.reset();
    jog_.reset();
    check_.reset();
    return;
  }
  next_poll_ = now_;
}

void GrblCore::reset_machine() {
  settled_at_.reset();
  output_.urgent = kSoftReset;
  output_.bytes.clear();
  window_.clear();
  outstanding_.clear();
  overrides_ = {};
  poll_.reset();
  next_poll_ = now_ + options_.fast_poll_period;
}

void GrblCore::connect_step(ConnectStep step) {
  connect_step_ = step;
  switch (step) {
    case ConnectStep::kWake:
      return;
    case ConnectStep::kBuildInfo:
      return send_text("$I\n");
    case ConnectStep::kSettings:
      return send_text("$$\n");
    case ConnectStep::kParserState:
      echo_seen_ = false;
      return send_text("$G\n");
    case ConnectStep::kStatus:
      poll_.reset();
      next_poll_ = now_;
      return;
  }
}

void GrblCore::on_connect_answer(std::optional<int> error_number) {
  switch (connect_step_) {
    case ConnectStep::kBuildInfo:
      return connect_step(ConnectStep::kSettings);  // without $I: stock sizes
    case ConnectStep::kSettings:
      return connect_step(ConnectStep::kParserState);
    case ConnectStep::kParserState:
      if (error_number || !echo_seen_) {
        fail({ErrorCode::kRefused, "the laser controller does not tell its modes ($G), so it cannot be supervised"});
        output_.close = true;
        return enter(Phase::kClosed);
      }
      return connect_step(ConnectStep::kStatus);
    case ConnectStep::kWake:
    case ConnectStep::kStatus:
      return;
  }
}

void GrblCore::finish_connect() {
  auto settings = settings_reader_.finish();
  if (!settings.ok()) {
    fail(settings.error());
    output_.close = true;
    return enter(Phase::kClosed);
  }
  settings_ = std::move(settings).value();
  window_ = SendWindow(settings_.receive_bytes);
  enter(Phase::kReady);
  const Axis &x = settings_.x, &y = settings_.y;
  events_.emplace_back(laser_event::Connected{
      {settings_.travel(), settings_.firmware, settings_.homing,
       MmPerSecond(std::min(x.max_rate_mm_s, y.max_rate_mm_s)),
       LaserMotion{MmPerSecond(x.max_rate_mm_s), MmPerSecond(y.max_rate_mm_s), MmPerSecond2(x.acceleration_mm_s2),
                   MmPerSecond2(y.acceleration_mm_s2), Millimetres(settings_.junction_deviation_mm),
                   static_cast<int>(settings_.planner_blocks)}}});
}

void GrblCore::begin_homing() {
  homed_ = homing_answered_ = focusing_ = false;
  enter(Phase::kHoming);
  poll_.reset();
  deadline_ = now_ + options_.homing_timeout;
  // A machine without switches stays where it is. It may be locked by the reset that stopped it; the operator who homes
  // it now vouches for the place where its head stands.
  send_text(settings_.homing ? "$H\n" : "$X\n");
}

void GrblCore::on_homing_answer(std::optional<int> error_number) {
  if (error_number) {
    fail({ErrorCode::kDeviceFault,
          fmt::format("the laser refused to {} with {}", focusing_ ? "move to the focus height" : "home",
                      describe_error(*error_number, settings_.family))});
    return enter(Phase::kReady);
  }
  homing_answered_ = true;
  next_poll_ = now_;
}

void GrblCore::finish_homing() {
  if (!last_report_->is("Idle") || !position_) return;  // the homing deadline bounds the wait
  if (focusing_ && !at_focus()) return;
  if (settings_.homing && options_.focus_z && !focusing_) {
    // G53 counts from the machine's own zero, whatever the modes; G0 is dark.
    focusing_ = true;
    homing_answered_ = false;
    return send_text(fmt::format("G21G53G0Z{:.3f}\n", options_.focus_z->count()));
  }
  enter(Phase::kReady);
  if (!settings_.homing) {
    if (options_.focus_z)
      return fail({ErrorCode::kRefused,
                   "the laser has no homing switches, so nothing says where its head stands over the wood: take "
                   "laser.focus_z_mm out of the configuration and set the focus by hand"});
    settings_.x.origin_mm = settings_.x.home_mm = (*position_)[0];
    settings_.y.origin_mm = settings_.y.home_mm = (*position_)[1];
    homed_ = true;
    events_.emplace_back(laser_event::Homed{});
    return;
  }
  const double tolerance = 0.05 + 1 / std::min(settings_.x.steps_per_mm, settings_.y.steps_per_mm);
  if (std::abs((*position_)[0] - settings_.x.home_mm) > tolerance ||
      std::abs((*position_)[1] - settings_.y.home_mm) > tolerance)
    return fail(
        {ErrorCode::kRefused,
         fmt::format("after homing the laser says it is at ({:.3f}, {:.3f}), but its settings $23, $27 and $130 "
                     "put the corner at ({:.3f}, {:.3f}): check them",
                     (*position_)[0], (*position_)[1], settings_.x.home_mm, settings_.y.home_mm)});
  homed_ = true;
  events_.emplace_back(laser_event::Homed{});
}

bool GrblCore::at_focus() const {
  return !options_.focus_z || (z_ && std::abs(*z_ - options_.focus_z->count()) <= 0.05);
}

void GrblCore::fail(Error error) { events_.emplace_back(laser_event::Failed{std::move(error)}); }

void GrblCore::drop_out(Error error, bool connected) {
  homed_ = false;
  after_door_.reset();
  events_.emplace_back(laser_event::Fault{std::move(error), connected});
}

}  // namespace veneer::grbl
