// Bytes to lines, lines to motion: the receive interrupt and the main loop of the firmware.
#include <cctype>
#include <charconv>
#include <utility>

#include "drivers/sim/grbl_controller/machine.h"

namespace veneer::sim {
namespace {

constexpr std::size_t kRingBytes = 128;
constexpr std::size_t kLineLength = 79;
constexpr int kDeferred = -1;  // the reply comes later
constexpr auto kEepromWrite = std::chrono::milliseconds(15);

}  // namespace

void GrblController::Impl::receive(std::string_view bytes, TimePoint now) {
  advance_to(now);
  const double byte_ns = options_.pace_baud > 0 ? 10e9 / options_.pace_baud : 0;
  for (const char c : bytes) {
    if (!link_up_ || !powered_) return;
    if (byte_ns > 0) {
      wire_in_free_ = std::max(wire_in_free_, time_) + Duration(static_cast<Duration::rep>(byte_ns));
      wire_in_.push_back({wire_in_free_, c});
    } else {
      arrive(c);
      run();
    }
  }
  advance_to(now);
}

void GrblController::Impl::arrive(char c) {
  if (dead() || boot_until_ || deaf_until_) return;
  if (take_fault({FaultKind::kUnplug})) {
    link_up_ = false;
    return;
  }
  if (take_fault({FaultKind::kDropByte})) return;
  if (c == '\n' && take_fault({FaultKind::kFuseLines})) return;
  if (take_fault({FaultKind::kGarbleByte})) c = static_cast<char>(std::uniform_int_distribution<int>(33, 126)(random_));
  if (realtime(static_cast<unsigned char>(c))) return;
  if (ring_.size() >= kRingBytes) {
    ++log_.lost_bytes;
    return;
  }
  ring_.push_back(c);
  if (c == '\n' || c == '\r') newline_stamps_.push_back(run_time_);
}

bool GrblController::Impl::realtime(unsigned char c) {
  if (c == 0x18) {
    soft_reset();
    return true;
  }
  const bool command = c == '?' || c == '!' || c == '~' || c >= 0x80;
  if (!command || critical_) return command;
  if (state_ == State::kHoming) {
    if (c == '?') status_pending_ = true;
    if (c == 0x84) begin_door();
    return true;
  }
  switch (c) {
    case '?':
      status_report();
      break;
    case '!':
      begin_hold();
      break;
    case '~':
      resume();
      break;
    case 0x84:
      begin_door();
      break;
    case 0x85:
      if (state_ == State::kJog) begin_hold();
      break;
    case 0x9E:
      if (state_ == State::kHold && hold_complete_) rest_s_ = 0;
      break;
    case 0xA0:
      if (state_ != State::kAlarm && state_ != State::kCheck) flood_ = !flood_;
      break;
    default:
      override_byte(c);
  }
  return true;
}

void GrblController::Impl::override_byte(unsigned char c) {
  const int feed = feed_override_;
  const int rapid = rapid_override_;
  const int spindle = spindle_override_;
  switch (c) {
    case 0x90:
      return set_overrides(100, rapid, spindle);
    case 0x91:
      return set_overrides(feed + 10, rapid, spindle);
    case 0x92:
      return set_overrides(feed - 10, rapid, spindle);
    case 0x93:
      return set_overrides(feed + 1, rapid, spindle);
    case 0x94:
      return set_overrides(feed - 1, rapid, spindle);
    case 0x95:
      return set_overrides(feed, 100, spindle);
    case 0x96:
      return set_overrides(feed, 50, spindle);
    case 0x97:
      return set_overrides(feed, 25, spindle);
    case 0x99:
      return set_overrides(feed, rapid, 100);
    case 0x9A:
      return set_overrides(feed, rapid, spindle + 10);
    case 0x9B:
      return set_overrides(feed, rapid, spindle - 10);
    case 0x9C:
      return set_overrides(feed, rapid, spindle + 1);
    case 0x9D:
      return set_overrides(feed, rapid, spindle - 1);
    default:
      return;
  }
}

void GrblController::Impl::run() {
  if (dead() || boot_until_ || deaf_until_) return;
  while (!critical_ && state_ != State::kHoming && !suspended() && !deaf_until_ && !stalled_) {
    if (line_open_) {
      if (!run_action()) break;
      continue;
    }
    if (ring_.empty()) break;
    const char c = ring_.front();
    ring_.pop_front();
    take_char(c);
  }
  if (!stalled_) settle();
}

void GrblController::Impl::take_char(char c) {
  if (c == '\n' || c == '\r') {
    if (!newline_stamps_.empty()) {
      line_stamp_ = newline_stamps_.front();
      newline_stamps_.pop_front();
    }
    line_complete();
    return;
  }
  if (comment_ != 0) {
    if (comment_ == '(' && c == ')') comment_ = 0;
    return;
  }
  if (c <= ' ' || c == '/') return;
  if (c == '(' || c == ';') {
    comment_ = c;
    return;
  }
  if (line_.size() >= kLineLength) {
    overflow_ = true;
    return;
  }
  line_ += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
}

void GrblController::Impl::line_complete() {
  const std::string line = std::move(line_);
  const bool overflow = overflow_;
  line_.clear();
  overflow_ = false;
  comment_ = 0;
  if (overflow) return reply(11);
  if (line.empty()) return reply(0);
  if (line_fault()) return;
  execute_line(line);
}

bool GrblController::Impl::line_fault() {
  const auto fault =
      take_fault({FaultKind::kError, FaultKind::kAlarm, FaultKind::kStall, FaultKind::kBanner, FaultKind::kSlip});
  if (!fault) return false;
  switch (fault->kind) {
    case FaultKind::kError:
      reply(fault->value == 0 ? 2 : fault->value);
      return true;
    case FaultKind::kAlarm:
      raise_alarm(fault->value, fault->value == 1 || fault->value == 2);
      return true;
    case FaultKind::kStall:
      kill_motion();
      stalled_ = true;
      return true;
    case FaultKind::kBanner: {
      kill_motion();
      const HeadPosition stands = head();
      motion_.set_position({});
      slip_ = stands;
      homed_ = false;
      state_ = settings_.flag(22) ? State::kAlarm : State::kIdle;
      restart();
      return true;
    }
    case FaultKind::kSlip:
      slip_.x_mm += fault->value * 1e-3;
      return false;
    default:
      return false;
  }
}

std::optional<Fault> GrblController::Impl::take_fault(std::initializer_list<FaultKind> kinds) {
  std::optional<Fault> due;
  for (auto it = faults_.begin(); it != faults_.end();) {
    bool counts = false;
    for (const FaultKind kind : kinds) counts = counts || it->kind == kind;
    if (counts && it->after > 0) --it->after;
    if (counts && it->after == 0 && !due) {
      due = *it;
      it = faults_.erase(it);
    } else {
      ++it;
    }
  }
  return due;
}

void GrblController::Impl::execute_line(const std::string& line) {
  actions_.clear();
  next_action_ = 0;
  int error = 0;
  if (line[0] == '$') {
    error = system_command(line);
  } else if (state_ == State::kAlarm || state_ == State::kJog) {
    error = 9;
  } else {
    jogging_line_ = false;
    error = gcode_.execute(line, actions_);
  }
  if (error == kDeferred) return;
  if (error != 0) return reply(error);
  line_open_ = true;
}

int GrblController::Impl::jog_command(const std::string& line) {
  if (state_ != State::kIdle && state_ != State::kJog) return 8;
  if (line.size() < 4 || line[2] != '=') return 3;
  const int error = gcode_.jog(std::string_view(line).substr(3), actions_);
  if (error == 0) jogging_line_ = true;
  return error;
}

int GrblController::Impl::system_command(const std::string& line) {
  if (line == "$") {
    say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n");
    return 0;
  }
  if (line[1] == 'J') return jog_command(line);
  if (line == "$$") {
    if (state_ == State::kCycle) return 8;
    say(settings_.listing());
    return 0;
  }
  if (line == "$G") {
    say(gcode_.modal_report());
    return 0;
  }
  if (line == "$C") {
    if (state_ == State::kCheck) {
      say("[MSG:Disabled]\r\n");
      reply(0);
      state_ = State::kIdle;
      restart();
      return kDeferred;
    }
    if (state_ != State::kIdle) return 8;
    state_ = State::kCheck;
    say("[MSG:Enabled]\r\n");
    return 0;
  }
  if (line == "$X") {
    if (state_ != State::kAlarm) return 0;
    if (interlocked()) return 13;
    say("[MSG:Caution: Unlocked]\r\n");
    state_ = State::kIdle;
    return 0;
  }
  return idle_command(line);
}

int GrblController::Impl::home_command() {
  if (!settings_.flag(22)) return 5;
  if (interlocked()) return 13;
  begin_homing();
  return kDeferred;
}

int GrblController::Impl::idle_command(const std::string& line) {
  if (state_ != State::kIdle && state_ != State::kAlarm) return 8;
  if (line == "$#") {
    say(gcode_.offsets_report());
    return 0;
  }
  if (line == "$H") return home_command();
  if (line == "$I") {
    say("[VER:1.1h.20190830:]\r\n");
    say(options_.door_pin ? "[OPT:V+,15,128]\r\n" : "[OPT:V,15,128]\r\n");
    return 0;
  }
  if (line == "$SLP") {
    reply(0);
    spindle_ = SpindleMode::kOff;
    rest_s_ = 0;
    state_ = State::kSleep;
    say("[MSG:Sleeping]\r\n");
    return kDeferred;
  }
  if (line == "$N") {
    for (std::size_t i = 0; i < startup_lines_.size(); ++i)
      say("$N" + std::to_string(i) + "=" + startup_lines_[i] + "\r\n");
    return 0;
  }
  if (line.starts_with("$N0=") || line.starts_with("$N1=")) {
    if (line.size() > 4) return 20;  // a laser must not move or fire by itself at start: only empty lines are kept
    deaf_until_ = time_ + kEepromWrite;
    return 0;
  }
  return store_setting(line);
}

int GrblController::Impl::store_setting(const std::string& line) {
  const auto equals = line.find('=');
  if (equals == std::string::npos) return 3;
  int number = 0;
  const char* const end = line.data() + equals;
  const auto [rest, error] = std::from_chars(line.data() + 1, end, number);
  if (error != std::errc() || rest != end) return 3;
  double value = 0;
  const char* const last = line.data() + line.size();
  const auto [stop, bad] = std::from_chars(end + 1, last, value);
  if (bad != std::errc() || stop != last) return 2;
  if (number == 20 && value != 0 && !settings_.flag(22)) return 10;
  if (const int refused = settings_.set(number, value)) return refused;
  deaf_until_ = time_ + kEepromWrite;
  return 0;
}

void GrblController::Impl::finish_line() {
  line_open_ = false;
  reply(0);
}

void GrblController::Impl::set_spindle(SpindleMode mode, double s) {
  spindle_ = mode;
  const bool dark_at_rest = mode == SpindleMode::kOff || (mode == SpindleMode::kDynamic && settings_.flag(32));
  rest_s_ = dark_at_rest ? 0 : s;
}

// False while the action waits.
bool GrblController::Impl::run_action() {
  if (next_action_ == actions_.size()) {
    finish_line();
    return true;
  }
  const gcode::Action& action = actions_[next_action_];
  if (const auto* line = std::get_if<gcode::Line>(&action)) {
    if (!try_line(*line)) return false;
  } else if (state_ != State::kCheck) {
    if (!motion_.empty() || !run_synced(action)) return false;
  }
  ++next_action_;
  return true;
}

bool GrblController::Impl::run_synced(const gcode::Action& action) {
  if (const auto* spindle = std::get_if<gcode::Spindle>(&action)) {
    set_spindle(spindle->mode, spindle->speed);
  } else if (const auto* coolant = std::get_if<gcode::Coolant>(&action)) {
    flood_ = coolant->flood;
  } else if (const auto* dwell = std::get_if<gcode::Dwell>(&action)) {
    if (dwell_left_ < 0) dwell_left_ = dwell->seconds;
    if (dwell_left_ > 0) return false;
    dwell_left_ = -1;
  } else if (std::holds_alternative<gcode::Pause>(action)) {
    paused_ = !paused_;
    if (paused_) {
      begin_hold();
      return false;
    }
  } else if (std::holds_alternative<gcode::ProgramEnd>(action)) {
    set_spindle(SpindleMode::kOff, 0);
    flood_ = false;
    set_overrides(100, 100, 100);
    say("[MSG:Pgm End]\r\n");
  } else if (std::holds_alternative<gcode::StoreOffsets>(action)) {
    deaf_until_ = time_ + kEepromWrite;
  }
  return true;
}

bool GrblController::Impl::try_line(const gcode::Line& line) {
  if (settings_.flag(20) && !jogging_line_) {
    for (int axis = 0; axis < 3; ++axis) {
      if (line.target[axis] <= 0 && line.target[axis] >= -settings_[130 + axis]) continue;
      if (motion_.running()) {
        soft_limit_ = true;
        state_ = State::kHold;
        hold_complete_ = false;
        motion_.hold();
      } else {
        raise_alarm(2, true);
      }
      return false;
    }
  }
  if (state_ == State::kCheck) return true;
  if (motion_.full()) return false;
  MotionRequest request;
  request.target = line.target;
  request.feed = line.feed;
  request.rapid = line.rapid;
  request.overridable = !jogging_line_;
  request.s = line.mode == SpindleMode::kOff ? 0 : line.speed;
  request.dynamic = line.mode == SpindleMode::kDynamic && settings_.flag(32);
  request.queued_at = line_stamp_;
  if (motion_.add(request)) return true;
  // A line of no length changes the power of a constant beam, after what was queued before.
  if (line.mode != SpindleMode::kConstant || !settings_.flag(32)) return true;
  if (!motion_.empty()) return false;
  set_spindle(line.mode, line.speed);
  return true;
}

}  // namespace veneer::sim
