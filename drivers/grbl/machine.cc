#include "drivers/grbl/machine.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::grbl {
namespace {

constexpr char kSoftReset = '\x18';

}  // namespace

void Machine::start_anew() {
  settings_reader = {};
  report_.reset();
  position_.reset();
  work_offset_.reset();
  z_.reset();
  offset_z_.reset();
  homed = lid_seen_ = false;
  corner.forget();
  ask();
}

void Machine::disconnected() {
  poll_.reset();
  polls_lost_ = 0;
  silent_since_.reset();
  forget_lines();
  report_.reset();
}

// ---- to the controller

void Machine::send(const GcodeLine& line) {
  window_.sent(line.text);
  outstanding_.push_back({line, ++lines_sent_});
  output_.bytes += line.text;
}

void Machine::send_text(std::string text) {
  GcodeLine line;
  line.text = std::move(text);
  send(line);
}

void Machine::reset() {
  corner.before_reset(position_);
  output_.urgent = kSoftReset;
  output_.bytes.clear();
  forget_lines();
  overrides = {};
  ask_afresh(options.fast_poll_period);
}

GrblOutput Machine::take_output() { return std::exchange(output_, {}); }

void Machine::step_overrides() {
  if (poll_ || overrides.settled()) return;
  output_.bytes += overrides.next_step();
  ask_not_before(options.fast_poll_period / 2);
}

// ---- answers

Result<Outstanding> Machine::answered() {
  if (outstanding_.empty())
    return Error{ErrorCode::kDeviceFault, "the laser controller answered more lines than it was sent"};
  Outstanding line = std::move(outstanding_.front());
  outstanding_.pop_front();
  if (!window_.acknowledged().ok()) return Error{ErrorCode::kInternal, "the send window lost count"};
  return line;
}

void Machine::forget_lines() {
  window_.clear();
  outstanding_.clear();
}

// ---- status questions

void Machine::ask_afresh(Duration in) {
  poll_.reset();
  ask(in);
}

void Machine::ask_if_due(Duration period) {
  if (poll_ || now < next_poll_) return;
  realtime('?');
  poll_ = Poll{now, outstanding_.empty(), lines_sent_};
  next_poll_ = now + period;
}

bool Machine::fell_silent() {
  if (poll_ && now - poll_->at >= options.poll_timeout) {
    if (!silent_since_) silent_since_ = poll_->at;
    poll_.reset();
    ++polls_lost_;
  }
  const bool silent = silent_since_ && now - *silent_since_ >= options.silence_timeout;
  if (!silent && polls_lost_ < options.polls_unanswered) return false;
  polls_lost_ = 0;
  silent_since_.reset();
  return true;
}

TimePoint Machine::next_poll_deadline() const { return poll_ ? poll_->at + options.poll_timeout : next_poll_; }

TimePoint Machine::silence_deadline() const {
  return silent_since_ ? *silent_since_ + options.silence_timeout : TimePoint::max();
}

// ---- reports

Heard Machine::heard(const StatusReport& report) {
  Heard heard;
  heard.poll = std::exchange(poll_, std::nullopt);
  polls_lost_ = 0;
  silent_since_.reset();
  const auto before = position_;
  follow(report);
  heard.moved = position_ != before;
  count_lid(report);
  report_ = report;
  heard.overrides_by_others = report.overrides && !overrides.reported(*report.overrides);
  return heard;
}

void Machine::follow(const StatusReport& report) {
  if (report.work_offset) work_offset_ = report.work_offset;
  if (report.offset_z) offset_z_ = report.offset_z;
  if (report.machine_z) z_ = report.machine_z;
  if (report.work_z && offset_z_) z_ = *report.work_z + *offset_z_;
  if (report.machine_position) {
    position_ = report.machine_position;
  } else if (report.work_position && work_offset_) {
    position_ = {(*report.work_position)[0] + (*work_offset_)[0], (*report.work_position)[1] + (*work_offset_)[1]};
  }
}

void Machine::count_lid(const StatusReport& report) {
  const bool was_open = lid_open(), was_latched = says("Door");
  if ((lid_is_open(report) && !was_open) || (report.is("Door") && !was_latched)) ++lid_openings_;
  lid_seen_ = lid_seen_ || report.is("Door");
}

std::optional<WirePoint> Machine::place() const {
  if (!position_) return std::nullopt;
  return WirePoint{std::llround((*position_)[0] * 1000), std::llround((*position_)[1] * 1000)};
}

bool Machine::at_focus() const { return !options.focus_z || (z_ && std::abs(*z_ - options.focus_z->count()) <= 0.05); }

LaserStatus Machine::status() const {
  LaserStatus status;
  status.lid_openings = lid_openings_;
  if (report_) status.state = report_->state;
  if (position_) status.position = settings.from_wire((*position_)[0], (*position_)[1]);
  status.beam_on = report_ && report_->power.value_or(0) > 0;
  status.homed = homed;
  status.firmware = settings.firmware;
  status.overrides = overrides.known();
  status.overrides_wanted = overrides.wanted();
  if (settings.lid_switch || lid_seen_) status.lid_open = lid_open();
  return status;
}

}  // namespace veneer::grbl
