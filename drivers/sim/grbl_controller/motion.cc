#include "drivers/sim/grbl_controller/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace veneer::sim {
namespace {

constexpr double kMinFeed = 1.0 / 60;  // mm/s, as GRBL's MINIMUM_FEED_RATE
constexpr double kTimeSlack = 2e-9;    // events are kept in whole nanoseconds

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

double Motion::limit_by_axes(const Vec3& unit, int first_setting) const {
  double limit = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis)
    if (unit[axis] != 0) limit = std::min(limit, settings_[first_setting + axis] / std::abs(unit[axis]));
  return limit;
}

double Motion::nominal_speed(const MotionBlock& block) const {
  double speed = block.programmed;
  if (block.request.rapid)
    speed *= rapid_override_;
  else if (block.request.overridable)
    speed *= feed_override_;
  return std::max(std::min(speed, block.rapid_rate), kMinFeed);
}

double Motion::corner_speed_sqr(const MotionBlock& before, const MotionBlock& block) const {
  const double cosine = -dot(before.unit, block.unit);
  if (cosine > 0.999999) return 0;  // straight back
  if (cosine < -0.999999) return std::numeric_limits<double>::max();
  Vec3 turn{};
  double norm = 0;
  for (int axis = 0; axis < 3; ++axis) {
    turn[axis] = block.unit[axis] - before.unit[axis];
    norm += turn[axis] * turn[axis];
  }
  for (double& t : turn) t /= std::sqrt(norm);
  const double accel = limit_by_axes(turn, 120);
  const double half_sine = std::sqrt(0.5 * (1 - cosine));
  return accel * settings_[11] * half_sine / (1 - half_sine);
}

bool Motion::add(const MotionRequest& request) {
  MotionBlock block;
  block.request = request;
  block.start = last_;
  Vec3 end{};
  double length_sqr = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double per_mm = settings_[100 + axis];
    end[axis] = static_cast<double>(std::lround(request.target[axis] * per_mm)) / per_mm;
    block.unit[axis] = end[axis] - last_[axis];
    length_sqr += block.unit[axis] * block.unit[axis];
  }
  if (length_sqr < 1e-12) return false;
  block.length = std::sqrt(length_sqr);
  for (double& u : block.unit) u /= block.length;
  block.accel = limit_by_axes(block.unit, 120);
  block.rapid_rate = limit_by_axes(block.unit, 110) / 60;
  block.programmed = request.rapid ? block.rapid_rate : request.feed;
  block.nominal = nominal_speed(block);
  block.junction_sqr = blocks_.empty() ? 0 : corner_speed_sqr(blocks_.back(), block);
  blocks_.push_back(block);
  last_ = end;
  plan();
  return true;
}

// Backward, then forward over the queue, from the speed of the moment.
void Motion::plan() {
  if (blocks_.empty()) return;
  blocks_.front().entry_sqr = speed_ * speed_;
  double exit_sqr = 0;
  for (std::size_t i = blocks_.size(); i-- > 1;) {
    MotionBlock& block = blocks_[i];
    const double before = blocks_[i - 1].nominal;
    const double highest = std::min({block.junction_sqr, block.nominal * block.nominal, before * before});
    block.entry_sqr = std::min(highest, exit_sqr + 2 * block.accel * block.length);
    exit_sqr = block.entry_sqr;
  }
  for (std::size_t i = 1; i < blocks_.size(); ++i) {
    const MotionBlock& before = blocks_[i - 1];
    const double way = i == 1 ? before.length - done_ : before.length;
    blocks_[i].entry_sqr = std::min(blocks_[i].entry_sqr, before.entry_sqr + 2 * before.accel * way);
  }
  build_profile();
}

void Motion::add_phase(double from, double to, double accel) {
  if (std::abs(from - to) < 1e-12) return;
  phases_[phase_count_++] = {std::abs(to - from) / accel, from, to > from ? accel : -accel};
}

void Motion::add_cruise(double speed, double length) {
  if (length > 1e-12) phases_[phase_count_++] = {length / speed, speed, 0};
}

void Motion::set_rest_profile(double speed, double remaining, double accel) {
  const double left_sqr = speed * speed - 2 * accel * remaining;
  ends_in_rest_ = left_sqr < 0;
  end_speed_ = ends_in_rest_ ? 0 : std::sqrt(left_sqr);
  add_phase(speed, end_speed_, accel);
}

void Motion::build_profile() {
  const MotionBlock& block = blocks_.front();
  const double a = block.accel;
  const double remaining = std::max(0.0, block.length - done_);
  phase_count_ = 0;
  phase_ = 0;
  ends_in_rest_ = false;
  if (holding_) return set_rest_profile(speed_, remaining, a);
  const double v = speed_;
  const double top = block.nominal;
  double exit = blocks_.size() > 1 ? std::sqrt(blocks_[1].entry_sqr) : 0;
  exit = std::min(exit, top);
  const double slow_down = std::max(0.0, v * v - top * top) / (2 * a);  // an override was taken back
  const double speed_up = std::max(0.0, top * top - v * v) / (2 * a);
  const double brake = (top * top - exit * exit) / (2 * a);
  if (slow_down + speed_up + brake <= remaining) {
    add_phase(v, top, a);
    add_cruise(top, remaining - slow_down - speed_up - brake);
    add_phase(top, exit, a);
    end_speed_ = exit;
    return;
  }
  const double peak_sqr = (2 * a * remaining + v * v + exit * exit) / 2;
  if (v <= top && peak_sqr >= v * v && peak_sqr >= exit * exit) {
    const double peak = std::sqrt(peak_sqr);
    add_phase(v, peak, a);
    add_phase(peak, exit, a);
    end_speed_ = exit;
    return;
  }
  // Too fast to reach the exit speed, or too slow: one straight ramp.
  const double way = exit > v ? 2 * a * remaining : -2 * a * remaining;
  end_speed_ = std::sqrt(std::max(0.0, v * v + way));
  add_phase(v, end_speed_, a);
}

Vec3 Motion::position() const {
  if (blocks_.empty()) return last_;
  const MotionBlock& block = blocks_.front();
  return {block.start[0] + block.unit[0] * done_, block.start[1] + block.unit[1] * done_,
          block.start[2] + block.unit[2] * done_};
}

double Motion::speed() const { return running_ && !blocks_.empty() ? speed_ : 0; }

void Motion::start() {
  if (blocks_.empty()) return;
  running_ = true;
  holding_ = false;
  speed_ = 0;
  plan();
}

void Motion::hold() {
  holding_ = true;
  if (running_) build_profile();
}

void Motion::flush() {
  last_ = position();
  blocks_.clear();
  running_ = false;
  holding_ = false;
  done_ = 0;
  speed_ = 0;
}

void Motion::set_position(const Vec3& position) {
  flush();
  last_ = position;
}

void Motion::set_overrides(double feed, double rapid) {
  feed_override_ = feed;
  rapid_override_ = rapid;
  for (MotionBlock& block : blocks_) block.nominal = nominal_speed(block);
  if (!holding_) plan();
}

double Motion::seconds_to_phase_end() const { return phase_ < phase_count_ ? phases_[phase_].seconds : 0; }

double Motion::seconds_to_event() const {
  double total = 0;
  for (std::size_t i = phase_; i < phase_count_; ++i) total += phases_[i].seconds;
  return total;
}

Motion::Step Motion::advance(double seconds) {
  Step step;
  step.from = position();
  step.request = blocks_.front().request;
  while (phase_ < phase_count_) {
    Phase& phase = phases_[phase_];
    const double dt = std::min(seconds, phase.seconds);
    done_ += phase.speed * dt + 0.5 * phase.accel * dt * dt;
    phase.speed = std::max(0.0, phase.speed + phase.accel * dt);
    phase.seconds -= dt;
    seconds -= dt;
    step.seconds += dt;
    speed_ = phase.speed;
    if (phase.seconds > kTimeSlack) break;
    ++phase_;
  }
  if (phase_ < phase_count_) {
    step.to = position();
    return step;
  }
  speed_ = end_speed_;
  if (ends_in_rest_) {
    running_ = false;
    step.stopped = true;
    step.to = position();
    return step;
  }
  done_ = blocks_.front().length;
  step.to = position();
  step.block_done = true;
  blocks_.pop_front();
  done_ = 0;
  if (!blocks_.empty()) {
    if (holding_ && speed_ < 1e-9) {
      running_ = false;
      step.stopped = true;
    } else {
      build_profile();
    }
    return step;
  }
  running_ = false;
  speed_ = 0;
  step.stopped = true;
  return step;
}

}  // namespace veneer::sim
