#include "drivers/sim/grbl_controller/machine.h"

#include <algorithm>
#include <cmath>

namespace veneer::sim {
namespace {

double seconds_between(TimePoint from, TimePoint to) { return static_cast<double>((to - from).count()) * 1e-9; }
TimePoint after(TimePoint from, double seconds) {
  return from + Duration(static_cast<Duration::rep>(std::ceil(seconds * 1e9)));
}

constexpr double kOverrun = 2;  // mm between a limit switch and the end of the rail

}  // namespace

double BurnSegment::length_mm() const { return std::hypot(to.x_mm - from.x_mm, to.y_mm - from.y_mm); }

double BurnSegment::energy_per_mm() const {
  const double length = length_mm();
  return length > 0 ? power_seconds / length : 0;
}

GrblController::Impl::Impl(const GrblSettings& settings, const GrblOptions& options, std::uint64_t seed, BurnSink* sink)
    : settings_(settings), options_(options), sink_(sink), random_(seed), motion_(settings_), gcode_(settings_) {
  std::uniform_real_distribution<double> anywhere(0.1, 0.9);
  const double x = anywhere(random_);
  slip_ = {-settings_[130] * x, -settings_[131] * anywhere(random_)};
}

HeadPosition GrblController::Impl::head() const {
  const Vec3 at = motion_.position();
  return {at[0] + slip_.x_mm, at[1] + slip_.y_mm};
}

void GrblController::Impl::put_head(HeadPosition at) {
  const Vec3 reported = motion_.position();
  slip_ = {at.x_mm - reported[0], at.y_mm - reported[1]};
}

void GrblController::Impl::power_on(TimePoint now) {
  if (powered_) {
    advance_to(now);
    kill_motion();
  }
  time_ = std::max(time_, now);
  powered_ = true;
  stalled_ = false;
  homed_ = false;
  critical_ = false;
  homing_until_.reset();
  const HeadPosition stands = head();
  motion_.set_position({});
  slip_ = stands;
  state_ = settings_.flag(22) ? State::kAlarm : State::kIdle;
  wire_in_.clear();
  wire_out_.clear();
  boot_until_ = time_ + options_.boot_time;
  if (options_.boot_time.count() == 0) advance_to(time_);
}

void GrblController::Impl::power_off(TimePoint now) {
  advance_to(now);
  kill_motion();
  powered_ = false;
  homed_ = false;
  wire_in_.clear();
  wire_out_.clear();
}

bool GrblController::Impl::moving() const { return !dead() && (motion_.running() || homing_until_.has_value()); }

double GrblController::Impl::power_of(double s) const {
  if (s <= 0) return 0;
  s *= spindle_override_ / 100.0;
  if (s <= settings_[31]) return 1.0 / 255;
  return std::min(1.0, s / settings_[30]);
}

double GrblController::Impl::moving_s() const {
  const MotionBlock* block = motion_.current();
  if (block == nullptr) return 0;
  return block->request.dynamic ? block->request.s * motion_.speed() / block->programmed : block->request.s;
}

double GrblController::Impl::beam_power() const {
  if (dead()) return 0;
  return power_of(motion_.running() ? moving_s() : rest_s_);
}

void GrblController::Impl::advance_to(TimePoint now) {
  while (true) {
    run();
    const std::optional<TimePoint> next = next_event_time();
    if (!next || *next > now) break;
    step_to(std::max(*next, time_));
  }
  if (now > time_) step_to(now);
  while (!wire_out_.empty() && wire_out_.front().at <= time_) {
    ready_ += wire_out_.front().text;
    wire_out_.pop_front();
  }
}

std::optional<TimePoint> GrblController::Impl::next_event_time() const {
  std::optional<TimePoint> next;
  const auto consider = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
  if (!wire_in_.empty()) consider(wire_in_.front().at);
  if (!wire_out_.empty() && wire_out_.front().at > time_) consider(wire_out_.front().at);
  if (dead()) return next;
  if (boot_until_) consider(*boot_until_);
  if (homing_until_) consider(*homing_until_);
  if (deaf_until_) consider(*deaf_until_);
  if (dwell_left_ > 0 && !suspended()) consider(after(time_, dwell_left_));
  if (motion_.running()) {
    const MotionRequest& request = motion_.current()->request;
    const bool steady = request.dynamic || request.s <= 0;  // the same energy on every millimetre of the block
    consider(after(time_, steady ? motion_.seconds_to_event() : motion_.seconds_to_phase_end()));
  }
  return next;
}

void GrblController::Impl::step_to(TimePoint t) {
  const double seconds = seconds_between(time_, t);
  const TimePoint start = time_;
  if (!dead()) {
    if (!suspended()) {
      run_time_ += seconds;
      if (dwell_left_ > 0) dwell_left_ = dwell_left_ - seconds < 1e-9 ? 0 : dwell_left_ - seconds;
    }
    if (motion_.running())
      move(seconds);
    else if (seconds > 0 && power_of(rest_s_) > 0)
      burn(head(), head(), power_of(rest_s_) * seconds, start, seconds);
  }
  time_ = t;
  if (boot_until_ && t >= *boot_until_) {
    boot_until_.reset();
    restart();
  }
  if (homing_until_ && t >= *homing_until_) finish_homing();
  if (deaf_until_ && t >= *deaf_until_) deaf_until_.reset();
  while (!wire_in_.empty() && wire_in_.front().at <= t) {
    const char c = wire_in_.front().c;
    wire_in_.pop_front();
    arrive(c);
  }
}

void GrblController::Impl::account_motion(double mm, bool burning) {
  if (!consent_) log_.moved_without_consent_mm += mm;
  if (!burning) return;
  log_.burnt_mm += mm;
  if (!consent_) log_.burnt_without_consent_mm += mm;
  if (!homed_) log_.burnt_unhomed_mm += mm;
}

void GrblController::Impl::move(double seconds) {
  const HeadPosition from = head();
  const double programmed = motion_.current()->programmed;
  const Motion::Step step = motion_.advance(seconds);
  const double mm = std::hypot(step.to[0] - step.from[0], step.to[1] - step.from[1]);
  // Against the end of the rail the motors lose steps.
  slip_.x_mm = std::clamp(step.to[0] + slip_.x_mm, -settings_[130] - kOverrun, kOverrun) - step.to[0];
  slip_.y_mm = std::clamp(step.to[1] + slip_.y_mm, -settings_[131] - kOverrun, kOverrun) - step.to[1];
  const double power = power_of(step.request.s);
  account_motion(mm, power > 0 && !interlocked());
  const HeadPosition to{step.to[0] + slip_.x_mm, step.to[1] + slip_.y_mm};
  const double way = std::hypot(mm, step.to[2] - step.from[2]);
  const double energy = step.request.dynamic ? power * way / programmed : power * step.seconds;
  if (power > 0 && energy > 0)
    burn(from, to, energy, time_, step.seconds);
  else if (sink_ != nullptr)
    sink_->moved(from, to);
  // Of a motion that is broken off too.
  log_.longest_queued_motion_s = std::max(log_.longest_queued_motion_s, run_time_ - step.request.queued_at);
  if (step.stopped) {
    rest_s_ = step.request.dynamic ? 0 : step.request.s;
    entered_rest();
  }
}

void GrblController::Impl::burn(const HeadPosition& from, const HeadPosition& to, double power_seconds, TimePoint start,
                                double seconds) {
  if (interlocked()) {
    log_.beam_while_lid_open_s += seconds;
    if (sink_ != nullptr) sink_->moved(from, to);
    return;
  }
  log_.beam_on_s += seconds;
  BurnSegment segment{from, to, power_seconds, start, after(start, seconds)};
  if (segment.length_mm() == 0) log_.beam_at_rest_s += seconds;
  if (sink_ != nullptr) sink_->burn(segment);
}

void GrblController::Impl::entered_rest() {
  if (soft_limit_) {
    soft_limit_ = false;
    raise_alarm(2, true);
    return;
  }
  if (state_ == State::kCycle || state_ == State::kJog) {
    if (jog_cancel_) {
      motion_.flush();
      gcode_.set_position(motion_.position());
    }
    jog_cancel_ = false;
    state_ = State::kIdle;
    return;
  }
  if (!suspended()) return;
  hold_complete_ = true;
  held_s_ = rest_s_;
  if (jog_cancel_) {  // a door opened during a jog: nothing to go back to
    motion_.flush();
    gcode_.set_position(motion_.position());
    jog_cancel_ = false;
  }
  if (settings_.flag(32) || state_ != State::kHold) {
    spindle_stopped_ = spindle_ != SpindleMode::kOff;
    rest_s_ = 0;
  }
}

void GrblController::Impl::settle() {
  if (state_ != State::kIdle || motion_.empty()) return;
  state_ = jogging_line_ ? State::kJog : State::kCycle;
  motion_.start();
}

void GrblController::Impl::begin_hold() {
  switch (state_) {
    case State::kCycle:
      state_ = State::kHold;
      hold_complete_ = false;
      motion_.hold();
      break;
    case State::kIdle:
      state_ = State::kHold;
      entered_rest();
      break;
    case State::kJog:
      jog_cancel_ = true;
      motion_.hold();
      break;
    default:
      break;
  }
}

void GrblController::Impl::begin_door() {
  if (state_ == State::kHoming) {
    kill_motion();
    homed_ = false;
    say("ALARM:7\r\n");
    state_ = State::kAlarm;
    restart();
    return;
  }
  if (state_ == State::kAlarm || state_ == State::kCheck || state_ == State::kDoor || state_ == State::kSleep) return;
  jog_cancel_ = jog_cancel_ || state_ == State::kJog;
  if (state_ != State::kHold) hold_complete_ = false;
  state_ = State::kDoor;
  if (motion_.running())
    motion_.hold();
  else
    entered_rest();
}

void GrblController::Impl::resume() {
  if (!suspended() || state_ == State::kSleep || !hold_complete_) return;
  if (state_ == State::kDoor && interlocked()) return;
  if (spindle_stopped_ && state_ == State::kHold) say("[MSG:Restoring spindle]\r\n");
  if (spindle_stopped_) rest_s_ = spindle_ == SpindleMode::kConstant && motion_.empty() ? held_s_ : 0;
  spindle_stopped_ = false;
  state_ = State::kIdle;
  if (!motion_.empty()) {
    state_ = State::kCycle;
    motion_.start();
  }
}

void GrblController::Impl::begin_homing() {
  const HeadPosition from = head();
  const double pull_off = settings_[27];
  const double way = std::max(std::abs(from.x_mm), std::abs(from.y_mm));
  const double seconds = way / (settings_[25] / 60) + 3 * pull_off / (settings_[24] / 60) + 4e-3 * settings_[26];
  account_motion(std::hypot(from.x_mm, from.y_mm) + 3 * pull_off, false);
  state_ = State::kHoming;
  rest_s_ = 0;
  homed_ = false;
  homing_until_ = after(time_, seconds);
}

void GrblController::Impl::finish_homing() {
  homing_until_.reset();
  const double pull_off = settings_[27];
  motion_.set_position({-pull_off, -pull_off, motion_.position()[2]});
  slip_ = {};
  homed_ = true;
  if (sink_ != nullptr) sink_->homed();
  gcode_.set_position(motion_.position());
  state_ = State::kIdle;
  reply(0);
  if (status_pending_) status_report();
}

void GrblController::Impl::kill_motion() {
  if (motion_.running() && motion_.speed() > 0) {
    std::uniform_real_distribution<double> slide(-options_.reset_slip_mm, options_.reset_slip_mm);
    slip_.x_mm += slide(random_);
    slip_.y_mm += slide(random_);
  }
  motion_.flush();
  homing_until_.reset();
  rest_s_ = 0;
  dwell_left_ = -1;
}

void GrblController::Impl::soft_reset() {
  const bool homing = state_ == State::kHoming;
  const bool moving = homing || motion_.running();
  kill_motion();
  if (moving) {
    homed_ = false;
    state_ = State::kAlarm;
    say(homing ? "ALARM:6\r\n" : "ALARM:3\r\n");
  }
  restart();
}

void GrblController::Impl::raise_alarm(int code, bool critical) {
  kill_motion();
  if (code != 2) homed_ = false;
  state_ = State::kAlarm;
  say("ALARM:" + std::to_string(code) + "\r\n");
  if (!critical) return restart();
  say("[MSG:Reset to continue]\r\n");
  critical_ = true;
  line_open_ = false;
}

void GrblController::Impl::restart() {
  ring_.clear();
  newline_stamps_.clear();
  line_.clear();
  overflow_ = false;
  comment_ = 0;
  actions_.clear();
  next_action_ = 0;
  line_open_ = jogging_line_ = paused_ = false;
  critical_ = soft_limit_ = jog_cancel_ = hold_complete_ = spindle_stopped_ = status_pending_ = false;
  deaf_until_.reset();
  dwell_left_ = -1;
  motion_.flush();
  gcode_.reset(motion_.position());
  spindle_ = SpindleMode::kOff;
  rest_s_ = held_s_ = 0;
  flood_ = false;
  set_overrides(100, 100, 100);
  wco_counter_ = override_counter_ = 0;
  banner();
  if (state_ == State::kAlarm || state_ == State::kSleep) {
    state_ = State::kAlarm;
    say("[MSG:'$H'|'$X' to unlock]\r\n");
    return;
  }
  state_ = State::kIdle;
  if (interlocked()) begin_door();
}

void GrblController::Impl::set_overrides(int feed, int rapid, int spindle) {
  feed = std::clamp(feed, 10, 200);
  spindle = std::clamp(spindle, 10, 200);
  if (feed == feed_override_ && rapid == rapid_override_ && spindle == spindle_override_) return;
  const bool speeds = feed != feed_override_ || rapid != rapid_override_;
  feed_override_ = feed;
  rapid_override_ = rapid;
  spindle_override_ = spindle;
  override_counter_ = 0;
  if (speeds) motion_.set_overrides(feed / 100.0, rapid / 100.0);
}

void GrblController::Impl::set_lid(bool open, TimePoint now) {
  advance_to(now);
  if (lid_open_ == open) return;
  lid_open_ = open;
  if (open && options_.door_pin && !dead() && !boot_until_) begin_door();
  advance_to(now);
}

}  // namespace veneer::sim
