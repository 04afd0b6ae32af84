// What the controller says, in GRBL 1.1h's words and cadence.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "drivers/sim/grbl_controller/machine.h"

namespace veneer::sim {
namespace {

// Reports between two that carry the work offset or the overrides.
constexpr int kWcoIdle = 10;
constexpr int kWcoBusy = 30;
constexpr int kOverrideIdle = 10;
constexpr int kOverrideBusy = 20;

}  // namespace

void GrblController::Impl::say(std::string_view text) {
  if (!powered_ || stalled_ || !link_up_) return;
  if (options_.pace_baud <= 0) {
    ready_ += text;
    return;
  }
  const double ns = 10e9 / options_.pace_baud * static_cast<double>(text.size());
  wire_out_free_ = std::max(wire_out_free_, time_) + Duration(static_cast<Duration::rep>(ns));
  wire_out_.push_back({wire_out_free_, std::string(text)});
}

std::string GrblController::Impl::take_output() { return std::exchange(ready_, {}); }

void GrblController::Impl::reply(int error) {
  if (error != 0) return say(fmt::format("error:{}\r\n", error));
  if (take_fault({FaultKind::kDropOk})) return;
  say("ok\r\n");
  if (take_fault({FaultKind::kDuplicateOk})) say("ok\r\n");
}

void GrblController::Impl::banner() { say("\r\nGrbl 1.1h ['$' for help]\r\n"); }

std::string GrblController::Impl::state_name() const {
  if (!powered_) return "Off";
  switch (state_) {
    case State::kIdle:
      return "Idle";
    case State::kAlarm:
      return "Alarm";
    case State::kCheck:
      return "Check";
    case State::kHoming:
      return "Home";
    case State::kCycle:
      return "Run";
    case State::kHold:
      return hold_complete_ ? "Hold:0" : "Hold:1";
    case State::kJog:
      return "Jog";
    case State::kDoor:
      return !hold_complete_ ? "Door:2" : lid_open_ ? "Door:1" : "Door:0";
    case State::kSleep:
      return "Sleep";
  }
  return "";
}

void GrblController::Impl::status_report() {
  status_pending_ = false;
  const Vec3 wco = gcode_.work_offset();
  if (wco != reported_wco_) wco_counter_ = 0;
  reported_wco_ = wco;
  const int mask = static_cast<int>(settings_[10]);
  const bool machine = (mask & 1) != 0;
  Vec3 at = motion_.position();
  for (int axis = 0; axis < 3; ++axis) {
    const double per_mm = settings_[100 + axis];
    at[axis] = static_cast<double>(std::lround(at[axis] * per_mm)) / per_mm;
    if (!machine) at[axis] -= wco[axis];
    if (settings_.flag(13)) at[axis] /= 25.4;
    if (at[axis] == 0) at[axis] = 0;  // no "-0.000"
  }
  std::string out =
      fmt::format("<{}|{}:{:.3f},{:.3f},{:.3f}", state_name(), machine ? "MPos" : "WPos", at[0], at[1], at[2]);
  if ((mask & 2) != 0) out += fmt::format("|Bf:{},{}", motion_.free_blocks(), 128 - ring_.size());
  const double s = (motion_.running() ? moving_s() : rest_s_) * spindle_override_ / 100.0;
  out += fmt::format("|FS:{:.0f},{:.0f}", motion_.speed() * 60, std::min(s, settings_[30]));
  if (interlocked()) out += "|Pn:D";
  const bool busy = state_ != State::kIdle && state_ != State::kAlarm && state_ != State::kCheck;
  if (wco_counter_ > 0) {
    --wco_counter_;
  } else {
    wco_counter_ = (busy ? kWcoBusy : kWcoIdle) - 1;
    if (override_counter_ == 0) override_counter_ = 1;  // never both in one report
    out += fmt::format("|WCO:{:.3f},{:.3f},{:.3f}", wco[0], wco[1], wco[2]);
  }
  if (override_counter_ > 0) {
    --override_counter_;
  } else {
    override_counter_ = (busy ? kOverrideBusy : kOverrideIdle) - 1;
    out += fmt::format("|Ov:{},{},{}", feed_override_, rapid_override_, spindle_override_);
    const bool on = spindle_ != SpindleMode::kOff && !spindle_stopped_;
    if (on || flood_) {
      out += "|A:";
      if (on) out += spindle_ == SpindleMode::kConstant ? "S" : "C";
      if (flood_) out += "F";
    }
  }
  say(out + ">\r\n");
}

}  // namespace veneer::sim
