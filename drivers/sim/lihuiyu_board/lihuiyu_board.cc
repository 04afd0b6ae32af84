// Time, motion and beam. The wire is in wire.cc.
#include "drivers/sim/lihuiyu_board/lihuiyu_board.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace veneer::sim {
namespace {

constexpr double kMmPerMil = 0.0254;
constexpr double kHomingPause = 0.5;  // at the switches

double seconds_between(TimePoint from, TimePoint to) { return std::chrono::duration<double>(to - from).count(); }
// Rounded up, so that a wait for the end of something never falls short of it.
Duration duration_of(double seconds) { return Duration(static_cast<Duration::rep>(std::ceil(seconds * 1e9))); }

}  // namespace

LihuiyuBoard::LihuiyuBoard(const BoardOptions& options, std::uint64_t seed, BurnSink* sink)
    : options_(options), sink_(sink), random_(seed) {}

void LihuiyuBoard::power_on(TimePoint now) {
  advance_to(now);
  if (powered_) return;
  powered_ = true;
  booting_until_ = now + options_.boot_time;
  locked_ = paused_ = rejected_ = finished_ = accepted_at_ = false;
  stalled_until_.reset();
  power_permille_ = 1000;
}

void LihuiyuBoard::power_off(TimePoint now) {
  advance_to(now);
  if (!powered_) return;
  stop_dead();
  powered_ = false;
  homed_ = false;
  booting_until_.reset();
}

void LihuiyuBoard::fail_supply(TimePoint now) {
  power_off(now);
  // A hang ends with the supply.
  locked_ = false;
  stalled_until_.reset();
}

void LihuiyuBoard::set_lid(bool open, TimePoint now) {
  advance_to(now);
  lid_open_ = open;
  if (!options_.lid_cuts_supply) return;
  if (open) {
    fail_supply(now);
  } else {
    power_on(now);
  }
}

void LihuiyuBoard::set_relay(bool on, TimePoint now) {
  advance_to(now);
  relay_on_ = on;
}

HeadPosition LihuiyuBoard::head() const { return {x_ - options_.travel_x_mm, -y_}; }

void LihuiyuBoard::put_head(HeadPosition at) {
  x_ = at.x_mm + options_.travel_x_mm;
  y_ = -at.y_mm;
  homed_ = false;
}

std::string LihuiyuBoard::state() const {
  if (!powered_) return "Off";
  if (hangs()) return "Stuck";
  if (paused_) return "Pause";
  if (homing_) return "Home";
  return motion_ ? "Run" : "Ready";
}

// ---- time

std::optional<TimePoint> LihuiyuBoard::next_event_time() const {
  std::optional<TimePoint> next;
  const auto at = [&](const std::optional<TimePoint>& t) {
    if (t && (!next || *t < *next)) next = t;
  };
  at(booting_until_);
  at(stalled_until_);
  at(supply_back_at_);
  at(replug_at_);
  if (motion_ && live()) at(time_ + duration_of(motion_->seconds - motion_->done));
  return next;
}

void LihuiyuBoard::advance_to(TimePoint now) {
  while (time_ < now) {
    const TimePoint until = std::min(now, next_event_time().value_or(now));
    step_to(std::max(until, time_));
    if (booting_until_ && time_ >= *booting_until_) booting_until_.reset();
    if (stalled_until_ && time_ >= *stalled_until_) stalled_until_.reset();
    if (replug_at_ && time_ >= *replug_at_) {
      replug_at_.reset();
      plug();
    }
    if (supply_back_at_ && time_ >= *supply_back_at_) {
      supply_back_at_.reset();
      if (!lid_open_) power_on(time_);
    }
    plan();
  }
}

void LihuiyuBoard::step_to(TimePoint t) {
  const double seconds = seconds_between(time_, t);
  if (motion_ && live()) {
    move(seconds);
  } else {
    rest(seconds);
  }
  time_ = t;
}

// Runs what takes no time, until a motion is under way or nothing is left.
void LihuiyuBoard::plan() {
  while (live() && !motion_) {
    if (!actions_.empty()) {
      const GlAction action = actions_.front();
      actions_.pop_front();
      begin(action);
      continue;
    }
    if (buffer_.empty()) {
      at_speed_ = false;
      commanded_ = gl_.beam();
      return;
    }
    Packet& packet = buffer_.front();
    stamp_ = packet.stamp;
    gl_.feed(std::string_view(packet.payload).substr(next_char_, 1));
    if (++next_char_ == packet.payload.size()) {
      buffer_.pop_front();
      next_char_ = 0;
    }
    for (const GlAction& action : gl_.take_actions()) actions_.push_back(action);
  }
}

void LihuiyuBoard::begin(const GlAction& action) {
  commanded_ = action.beam;
  Motion motion{.action = action, .from_x = x_, .from_y = y_, .to_x = x_, .to_y = y_, .stamp = stamp_};
  switch (action.kind) {
    case GlAction::Kind::kFinish:
      finished_ = true;
      at_speed_ = false;
      return;
    case GlAction::Kind::kUnlock:
      homed_ = false;
      return;
    case GlAction::Kind::kHome:
      motion.to_x = motion.to_y = 0;
      motion.seconds = kHomingPause + (x_ + y_) / options_.homing_mm_s;
      homing_ = true;
      break;
    case GlAction::Kind::kMove: {
      motion.to_x += static_cast<double>(action.dx) * kMmPerMil;
      motion.to_y += static_cast<double>(action.dy) * kMmPerMil;
      const auto x = static_cast<double>(std::abs(action.dx)), y = static_cast<double>(std::abs(action.dy));
      const double both = std::min(x, y), one = std::max(x, y) - both;
      if (action.compact) {
        const double step = action.speed.step_seconds() / options_.true_speed;
        motion.seconds = one * step + both * action.speed.diagonal_seconds() / options_.true_speed;
        // Out of rest the head gathers speed over v^2 / 2a, and brakes later as it does before: three times as long.
        const double speed = kMmPerMil / step;
        if (!at_speed_) ramp_mm_ = speed * speed / (2 * options_.acceleration_mm_s2);
        const double slow = std::min(ramp_mm_, (one + both) * kMmPerMil);
        motion.seconds += 2 * slow / speed;
        ramp_mm_ -= slow;
        at_speed_ = true;
      } else {
        motion.seconds =
            std::max(x, y) * kMmPerMil / options_.rapid_mm_s + options_.rapid_mm_s / options_.acceleration_mm_s2;
      }
    }
  }
  motion_ = motion;
}

void LihuiyuBoard::move(double seconds) {
  Motion& motion = *motion_;
  seconds = std::min(seconds, motion.seconds - motion.done);
  motion.done += seconds;
  const bool ends = motion.seconds - motion.done < 1e-9;
  const double share = ends || motion.seconds <= 0 ? 1 : motion.done / motion.seconds;
  const double at_x = motion.from_x + share * (motion.to_x - motion.from_x);
  const double at_y = motion.from_y + share * (motion.to_y - motion.from_y);
  const double x = std::clamp(at_x, 0.0, options_.travel_x_mm), y = std::clamp(at_y, 0.0, options_.travel_y_mm);
  const double mm = std::hypot(x - x_, y - y_);
  if (!consent_) log_.moved_without_consent_mm += mm;
  if (burning_power() > 0)
    burn(x_, y_, x, y, seconds);
  else if (sink_ != nullptr)
    sink_->moved({x_ - options_.travel_x_mm, -y_}, {x - options_.travel_x_mm, -y});
  if (commanded_ && powered_ && lid_open_) log_.beam_while_lid_open_s += seconds;
  if (commanded_ && powered_ && !relay_on_) log_.beam_while_relay_off_s += seconds;
  x_ = x;
  y_ = y;
  if (motion.action.compact) motion_time_ += seconds;
  if (!ends) return;
  if (motion.action.compact)
    log_.longest_queued_motion_s = std::max(log_.longest_queued_motion_s, motion_time_ - motion.stamp);
  const double ground = std::hypot(at_x - x, at_y - y);
  if (ground > 1e-9) {
    log_.ground_mm += ground;
    homed_ = false;
  }
  if (motion.action.kind == GlAction::Kind::kHome) {
    homing_ = false;
    homed_ = true;
    if (sink_ != nullptr) sink_->homed();
  }
  motion_.reset();
}

void LihuiyuBoard::rest(double seconds) {
  if (!powered_ || !commanded_ || seconds <= 0) return;
  if (lid_open_) log_.beam_while_lid_open_s += seconds;
  if (!relay_on_) log_.beam_while_relay_off_s += seconds;
  if (burning_power() <= 0) return;
  log_.beam_at_rest_s += seconds;
  burn(x_, y_, x_, y_, seconds);
}

void LihuiyuBoard::burn(double x0, double y0, double x1, double y1, double seconds) {
  const double mm = std::hypot(x1 - x0, y1 - y0);
  log_.beam_on_s += seconds;
  log_.burnt_mm += mm;
  if (!homed_) log_.burnt_unhomed_mm += mm;
  if (!consent_) log_.burnt_without_consent_mm += mm;
  if (sink_ == nullptr || seconds <= 0) return;
  BurnSegment segment;
  segment.from = {x0 - options_.travel_x_mm, -y0};
  segment.to = {x1 - options_.travel_x_mm, -y1};
  segment.power_seconds = burning_power() * seconds;
  segment.start = time_;
  segment.end = time_ + duration_of(seconds);
  sink_->burn(segment);
}

double LihuiyuBoard::burning_power() const {
  if (!powered_ || !commanded_ || !relay_on_ || lid_open_ || paused_) return 0;
  return options_.m3 ? power_permille_ / 1000.0 : options_.panel_power;
}

// As `I` does, or a supply that fails: what was queued is gone, the head slides on a little.
void LihuiyuBoard::stop_dead() {
  if (motion_) {
    std::uniform_real_distribution<double> slip(-options_.reset_slip_mm, options_.reset_slip_mm);
    x_ = std::clamp(x_ + slip(random_), 0.0, options_.travel_x_mm);
    y_ = std::clamp(y_ + slip(random_), 0.0, options_.travel_y_mm);
    homed_ = false;
  }
  motion_.reset();
  actions_.clear();
  buffer_.clear();
  next_char_ = 0;
  gl_.feed("I");
  commanded_ = homing_ = paused_ = at_speed_ = false;
}

}  // namespace veneer::sim
