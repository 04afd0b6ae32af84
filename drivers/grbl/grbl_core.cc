#include "drivers/grbl/grbl_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::grbl {
namespace {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace

GrblOptions GrblOptions::for_time_scale(double scale) {
  GrblOptions options;
  if (!(scale > 1)) return options;
  for (Duration* limit :
       {&options.connect_timeout, &options.banner_wait, &options.settle_time, &options.poll_timeout,
        &options.silence_timeout, &options.lost_reply_timeout, &options.hold_timeout, &options.resume_timeout,
        &options.stop_timeout, &options.stall_timeout, &options.late_tolerance})
    *limit = Duration(std::llround(static_cast<double>(limit->count()) * scale));
  return options;
}

GrblCore::GrblCore(const GrblOptions& options) : options_(options) {}

// ---- commands

void GrblCore::connect(TimePoint now) {
  now_ = now;
  reader_.clear();
  settings_reader_ = {};
  last_report_.reset();
  position_.reset();
  work_offset_.reset();
  z_.reset();
  offset_z_.reset();
  homed_ = home_wanted_ = false;
  run_.reset();
  jog_.reset();
  check_.reset();
  enter(Phase::kConnecting);
  connect_step_ = ConnectStep::kWake;
  deadline_ = now + options_.connect_timeout;
  // Stops whatever a former host left running, and throws away half a line it left in the buffer.
  reset_machine();
}

void GrblCore::home(TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed || phase_ == Phase::kConnecting)
    return fail({ErrorCode::kUnavailable, "the laser is not connected, so it cannot be homed"});
  if (phase_ == Phase::kHoming) return;
  if (job_running()) return fail({ErrorCode::kConflict, "a job is running: stop it before homing the laser"});
  if (phase_ == Phase::kJogging || phase_ == Phase::kChecking)
    return fail({ErrorCode::kConflict, "the laser is busy: wait until it stands still, then home it"});
  if (phase_ == Phase::kResetting) {
    // The banner that ends the reset is still awaited.
    home_wanted_ = true;
    if (now_ - phase_begin_ > options_.banner_wait) reset_machine();  // it was lost: ask for another
    deadline_ = now_ + options_.banner_wait;
    return;
  }
  if (last_report_ && last_report_->is("Door")) {
    if (last_report_->state != "Door:0") return fail({ErrorCode::kRefused, "the lid is open: close it, then home"});
    // A controller that waits for a cycle start after its lid was closed takes no line; a reset at rest ends the wait.
    enter(Phase::kResetting);
    reset_machine();
    home_wanted_ = true;
    deadline_ = now_ + options_.banner_wait;
    return;
  }
  begin_homing();
}

void GrblCore::start(LaserJob job, TimePoint now) {
  now_ = now;
  // A panel is laid through the lid: closed again, the controller waits for a cycle start with nothing left to do.
  if (phase_ == Phase::kReady && !after_door_ && homed_ && last_report_ && last_report_->state == "Door:0") {
    if (const Status good = check_job(job, settings_); !good.ok()) return fail(good.error());
    after_door_ = std::move(job);
    output_.bytes += '~';
    deadline_ = now_ + options_.resume_timeout;
    next_poll_ = now_;
    return;
  }
  if (const Status allowed = may_run(job); !allowed.ok()) return fail(allowed.error());
  const WirePoint at{std::llround((*position_)[0] * 1000), std::llround((*position_)[1] * 1000)};
  run_.emplace(std::move(job), settings_, options_, at);
  run_->motion().set_slowest(overrides_.slowest_wanted(), now_);
  hold_ = Hold::kNone;
  off_path_ = idle_reports_ = 0;
  last_progress_ = now_;
  enter(Phase::kJob);
  pump();
}

void GrblCore::hold(TimePoint now) {
  now_ = now;
  if (std::exchange(after_door_, std::nullopt))
    return fail({ErrorCode::kCancelled, "the laser was held before it began: start again"});
  if (phase_ != Phase::kJob || hold_ == Hold::kRequested || hold_ == Hold::kHeld) return;
  hold_ = Hold::kRequested;
  output_.bytes += '!';
  deadline_ = now_ + options_.hold_timeout;
  next_poll_ = std::min(next_poll_, now_);
}

void GrblCore::resume(TimePoint now) {
  now_ = now;
  if (phase_ != Phase::kJob || hold_ != Hold::kHeld) return;
  if (last_report_ && last_report_->is("Door") && last_report_->state != "Door:0") {
    // The lid is open: the controller would ignore the byte, the machine stays held.
    events_.emplace_back(laser_event::Held{});
    return;
  }
  hold_ = Hold::kResuming;
  output_.bytes += '~';
  deadline_ = now_ + options_.resume_timeout;
  // An answer on its way still tells of the hold.
  poll_.reset();
  next_poll_ = now_ + options_.fast_poll_period / 2;
}

void GrblCore::stop_after_piece() {
  if (run_) run_->stop_after_piece();
}

void GrblCore::abort(TimePoint now) {
  now_ = now;
  const Error cancelled{ErrorCode::kCancelled, "the laser was stopped by command"};
  if (std::exchange(after_door_, std::nullopt)) fail(cancelled);
  switch (phase_) {
    case Phase::kClosed:
      return;
    case Phase::kJob: {
      const bool stands_still = hold_ == Hold::kHeld;
      reset_machine();
      return end_job(cancelled, !stands_still);
    }
    case Phase::kStopping:
      reset_machine();
      return end_job(stop_error_, true);
    case Phase::kJogging:
      return break_jog(cancelled);
    case Phase::kChecking:
      return fail_check(cancelled, false);
    case Phase::kConnecting:
    case Phase::kHoming:
      homed_ = false;
      reset_machine();
      fail(cancelled);
      output_.close = phase_ == Phase::kConnecting;
      return enter(phase_ == Phase::kConnecting ? Phase::kClosed : Phase::kResetting);
    case Phase::kReady:
    case Phase::kResetting:
      reset_machine();
      return enter(Phase::kResetting);
  }
}

// ---- what comes in

void GrblCore::receive(std::string_view bytes, TimePoint now) {
  now_ = now;
  reader_.feed(bytes, [this](std::string_view line) {
    if (phase_ != Phase::kClosed) handle(parse_reply(line));
  });
  pump();
}

void GrblCore::handle(const Reply& reply) {
  std::visit(Overloaded{
                 [&](const Acknowledged&) { on_answer(std::nullopt); },
                 [&](const Refused& refused) { on_answer(refused.number); },
                 [&](const AlarmRaised& alarm) { on_alarm(alarm.number); },
                 [&](const Banner& banner) { on_banner(banner); },
                 [&](const StatusReport& report) { on_report(report); },
                 [&](const SettingLine& setting) { settings_reader_.setting(setting); },
                 [&](const BuildOptions& build) { settings_reader_.options(build); },
                 [&](const BuildVersion& version) { settings_reader_.version(version); },
                 [&](const Firmware& firmware) { settings_reader_.firmware(firmware); },
                 [&](const ParserState& state) { on_parser_state(state); },
                 [](const Message&) {},
                 // Noise. If it was an answer, the missing answer will be noticed.
                 [](const UnknownReply&) {},
             },
             reply);
}

void GrblCore::on_answer(std::optional<int> error_number) {
  if (outstanding_.empty()) {
    if (phase_ == Phase::kJob)
      emergency({ErrorCode::kDeviceFault, "the laser controller answered more lines than it was sent"});
    return;
  }
  const Outstanding answered = std::move(outstanding_.front());
  outstanding_.pop_front();
  if (!window_.acknowledged().ok()) return emergency({ErrorCode::kInternal, "the send window lost count"});
  idle_since_.reset();
  last_progress_ = now_;
  if (phase_ == Phase::kConnecting) return on_connect_answer(error_number);
  if (phase_ == Phase::kHoming) return on_homing_answer(error_number);
  if (phase_ == Phase::kJogging) return on_jog_answer(error_number);
  if (phase_ == Phase::kChecking) return on_check_answer(answered, error_number);
  if (phase_ != Phase::kJob) return;
  if (error_number) {
    std::string text = answered.line.text;
    text.pop_back();
    return stop_softly(
        {ErrorCode::kDeviceFault, fmt::format("the laser controller refused line {} \"{}\" with {}", answered.number,
                                              text, describe_error(*error_number, settings_.family))});
  }
  run_->acknowledged(answered.line, now_);
  if (answered.line.kind == LineKind::kEcho && !std::exchange(echo_seen_, false))
    stop_softly({ErrorCode::kDeviceFault,
                 fmt::format("the laser controller did not tell how it understood stroke {}: its answers "
                             "do not match the lines it was sent",
                             answered.line.stroke)});
}

void GrblCore::on_alarm(int number) {
  const Error error{ErrorCode::kDeviceFault,
                    fmt::format("the laser stopped with {}", describe_alarm(number, settings_.family))};
  switch (phase_) {
    case Phase::kClosed:
    case Phase::kConnecting:
    case Phase::kResetting:
      return;  // ALARM:3 answers a reset in motion
    case Phase::kJob:
      return emergency(error);
    case Phase::kStopping:
      reset_machine();
      return end_job(stop_error_, true);
    case Phase::kJogging:
      return break_jog(error);
    case Phase::kChecking:
      return fail_check(error, true);
    case Phase::kHoming:
      reset_machine();
      fail(error);
      return enter(Phase::kResetting);
    case Phase::kReady:
      // After a hard limit GRBL answers nothing until it is reset.
      reset_machine();
      drop_out(error, true);
      return enter(Phase::kResetting);
  }
}

void GrblCore::on_banner(const Banner& banner) {
  const Error error{ErrorCode::kDeviceFault,
                    "the laser controller was reset, by itself or by a hand: check its power, then home it"};
  window_.clear();
  outstanding_.clear();
  overrides_ = {};
  switch (phase_) {
    case Phase::kClosed:
      return;
    case Phase::kConnecting:
      settings_reader_.banner(banner);
      connect_step(ConnectStep::kWake);
      settled_at_ = now_ + options_.settle_time;
      return;
    case Phase::kResetting:
      settled_at_ = now_ + options_.settle_time;
      return;
    case Phase::kReady:
      return drop_out(error, true);
    case Phase::kChecking:
      if (check_->step != CheckStep::kLeaving) return fail_check(error, true);
      settled_at_ = now_ + options_.settle_time;
      return;
    case Phase::kJogging:
      return break_jog(error);
    case Phase::kHoming:
      homed_ = false;
      fail(error);
      return enter(Phase::kReady);
    case Phase::kJob:
      return emergency(error);
    case Phase::kStopping:
      reset_machine();
      return end_job(stop_error_, true);
  }
}

void GrblCore::on_report(const StatusReport& report) {
  const std::optional<Poll> poll = std::exchange(poll_, std::nullopt);
  polls_lost_ = 0;
  silent_since_.reset();
  if (report.work_offset) work_offset_ = report.work_offset;
  if (report.offset_z) offset_z_ = report.offset_z;
  if (report.machine_z) z_ = report.machine_z;
  if (report.work_z && offset_z_) z_ = *report.work_z + *offset_z_;
  const auto before = position_;
  if (report.machine_position) {
    position_ = report.machine_position;
  } else if (report.work_position && work_offset_) {
    position_ = {(*report.work_position)[0] + (*work_offset_)[0], (*report.work_position)[1] + (*work_offset_)[1]};
  }
  if (position_ != before) last_progress_ = now_;
  last_report_ = report;
  const bool strangers = report.overrides && !overrides_.reported(*report.overrides);
  switch (phase_) {
    case Phase::kClosed:
      return;
    case Phase::kConnecting:
      if (connect_step_ == ConnectStep::kWake && !settled_at_ && now_ - phase_begin_ >= options_.banner_wait)
        return connect_step(ConnectStep::kBuildInfo);
      if (connect_step_ == ConnectStep::kStatus && position_) finish_connect();
      return;
    case Phase::kHoming:
      if (homing_answered_) finish_homing();
      return;
    case Phase::kReady:
      drive_overrides();
      if (after_door_ && report.is("Idle")) {
        deadline_.reset();
        LaserJob job = std::move(*after_door_);
        after_door_.reset();
        return start(std::move(job), now_);
      }
      if (homed_ && report.is("Alarm")) {
        reset_machine();
        drop_out({ErrorCode::kDeviceFault, "the laser went into alarm: clear what stopped it, then home it"}, true);
        enter(Phase::kResetting);
      }
      return;
    case Phase::kResetting:
      return;
    case Phase::kJogging:
      if (position_ != before) deadline_ = now_ + options_.stall_timeout;
      return on_jog_report(report, poll);
    case Phase::kChecking:
      return on_check_report(report);
    case Phase::kJob:
      if (strangers)
        return stop_softly(
            {ErrorCode::kDeviceFault, "the speed or power override of the laser was changed at the machine"});
      run_->motion().set_slowest(overrides_.slowest_wanted(), now_);
      on_job_report(report, poll);
      return drive_overrides();
    case Phase::kStopping:
      if (report.is("Idle") || report.state == "Hold:0" || report.state == "Hold" || report.state == "Door:0" ||
          report.state == "Door:1") {
        reset_machine();
        end_job(stop_error_, false);
      }
      return;
  }
}

void GrblCore::link_lost(const Error& error, TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed) return;
  if (std::exchange(after_door_, std::nullopt)) fail(error);
  const Phase phase = phase_;
  if (job_running()) {
    end_job(phase == Phase::kStopping ? stop_error_ : error, true);
  } else if (phase == Phase::kConnecting || phase == Phase::kHoming || phase == Phase::kChecking || home_wanted_) {
    fail(error);
  } else {
    drop_out(error, false);
  }
  homed_ = home_wanted_ = false;
  enter(Phase::kClosed);
}

// ---- time

void GrblCore::tick(TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed) return;
  if (deadline_ && now_ >= *deadline_) {
    deadline_.reset();
    on_deadline();
  }
  if (settled_at_ && now_ >= *settled_at_) {
    settled_at_.reset();
    on_settled();
  }
  poll_if_due();
  if (phase_ == Phase::kJob) check_progress();
  pump();
}

void GrblCore::on_deadline() {
  switch (phase_) {
    case Phase::kConnecting:
      fail({ErrorCode::kTimeout,
            "no GRBL controller answers on the laser's port: check power, cable and the port in the configuration"});
      reset_machine();
      output_.close = true;
      return enter(Phase::kClosed);
    case Phase::kHoming:
      homed_ = false;
      reset_machine();
      fail({ErrorCode::kTimeout, focusing_
                                     ? "the laser's head did not reach the focus height (laser.focus_z_mm) in time"
                                     : "the laser did not finish homing in time"});
      return enter(Phase::kResetting);
    case Phase::kResetting:
      if (std::exchange(home_wanted_, false))
        fail({ErrorCode::kTimeout, "the laser controller does not come back from its reset: switch it off and on"});
      return;
    case Phase::kJogging:
      return break_jog(
          {ErrorCode::kDeviceFault, "the laser neither moves nor answers while it is jogged: it is stuck"});
    case Phase::kChecking:
      return fail_check({ErrorCode::kDeviceFault, "the laser controller stopped answering in its check mode"}, false);
    case Phase::kStopping:
      reset_machine();
      return end_job(stop_error_, true);
    case Phase::kJob:
      if (hold_ == Hold::kRequested)
        return emergency({ErrorCode::kDeviceFault, "the laser did not stand still with the beam off after a hold"});
      if (hold_ == Hold::kResuming) {
        hold_ = Hold::kHeld;
        events_.emplace_back(laser_event::Held{});
      }
      return;
    case Phase::kReady:
      if (std::exchange(after_door_, std::nullopt))
        fail({ErrorCode::kRefused, "the laser still says that its lid is open: close it"});
      return;
    case Phase::kClosed:
      return;
  }
}

void GrblCore::on_settled() {
  if (phase_ == Phase::kConnecting) return connect_step(ConnectStep::kBuildInfo);
  if (phase_ == Phase::kChecking) {
    check_.reset();
    enter(Phase::kReady);
    events_.emplace_back(laser_event::Checked{});
    return;
  }
  if (phase_ != Phase::kResetting) return;
  enter(Phase::kReady);
  if (std::exchange(home_wanted_, false)) begin_homing();
}

void GrblCore::on_silence() {
  const Error error{ErrorCode::kDisconnected, "the laser controller stopped answering"};
  if (phase_ == Phase::kConnecting) return;  // it may still be booting; the connect deadline rules
  // The link may be dead, but if it is not, this stops the machine.
  reset_machine();
  link_lost(error, now_);
  output_.close = true;
}

bool GrblCore::polling() const {
  // Stock GRBL answers nothing while it homes.
  return phase_ != Phase::kClosed && (phase_ != Phase::kHoming || homing_answered_);
}

Duration GrblCore::poll_period() const {
  if (phase_ == Phase::kReady) return options_.rest_poll_period;
  const bool awaiting = phase_ != Phase::kJob || hold_ == Hold::kRequested || hold_ == Hold::kResuming ||
                        (run_ && run_->all_sent() && outstanding_.empty());
  return awaiting ? options_.fast_poll_period : options_.poll_period;
}

void GrblCore::poll_if_due() {
  if (!polling()) return;
  if (poll_ && now_ - poll_->at >= options_.poll_timeout) {
    if (!silent_since_) silent_since_ = poll_->at;
    poll_.reset();
    ++polls_lost_;
  }
  const bool silent = silent_since_ && now_ - *silent_since_ >= options_.silence_timeout;
  if (silent || polls_lost_ >= options_.polls_unanswered) {
    polls_lost_ = 0;
    silent_since_.reset();
    on_silence();
    if (phase_ == Phase::kClosed) return;
  }
  if (poll_ || now_ < next_poll_) return;
  output_.bytes += '?';
  poll_ = Poll{now_, outstanding_.empty(), lines_sent_};
  next_poll_ = now_ + poll_period();
}

Status GrblCore::set_overrides(const LaserOverrides& overrides, TimePoint now) {
  now_ = now;
  // In a jog they wait until the head rests.
  if (phase_ != Phase::kReady && phase_ != Phase::kJob && phase_ != Phase::kJogging)
    return Error{ErrorCode::kConflict, "the laser is not ready: overrides are set at rest or while a job runs"};
  if (const Status allowed = overrides_.want(overrides); !allowed.ok()) return allowed;
  if (run_) run_->motion().set_slowest(overrides_.slowest_wanted(), now_);
  drive_overrides();
  return Ok();
}

void GrblCore::drive_overrides() {
  // A report under way may still tell of the time before the step.
  if (poll_ || overrides_.settled() || (phase_ != Phase::kReady && phase_ != Phase::kJob)) return;
  if (phase_ == Phase::kJob) {
    if (hold_ != Hold::kNone) return;
    // What is queued must still last no longer than allowed once it runs slower.
    if (overrides_.slowest_wanted() < overrides_.slowest() && run_->motion().queued_s() > options_.queued_motion_s)
      return;
  }
  output_.bytes += overrides_.next_step();
  next_poll_ = std::max(next_poll_, now_ + options_.fast_poll_period / 2);
}

TimePoint GrblCore::next_deadline() const {
  if (phase_ == Phase::kClosed) return TimePoint::max();
  TimePoint next = std::min(deadline_.value_or(TimePoint::max()), settled_at_.value_or(TimePoint::max()));
  if (polling()) next = std::min(next, poll_ ? poll_->at + options_.poll_timeout : next_poll_);
  if (silent_since_) next = std::min(next, *silent_since_ + options_.silence_timeout);
  if (phase_ == Phase::kJob && hold_ == Hold::kNone) {
    if (idle_since_) next = std::min(next, *idle_since_ + options_.lost_reply_timeout);
    next = std::min(next, last_progress_ + options_.stall_timeout);
  }
  return next;
}

// ---- what goes out

GrblOutput GrblCore::take_output() { return std::exchange(output_, {}); }

std::vector<LaserEvent> GrblCore::take_events() { return std::exchange(events_, {}); }

LaserStatus GrblCore::status() const {
  LaserStatus status;
  status.connected = phase_ != Phase::kClosed && phase_ != Phase::kConnecting;
  if (!status.connected) return status;
  if (last_report_) status.state = last_report_->state;
  if (position_) status.position = settings_.from_wire((*position_)[0], (*position_)[1]);
  status.beam_on = last_report_ && last_report_->power.value_or(0) > 0;
  status.homed = homed_;
  status.firmware = settings_.firmware;
  status.overrides = overrides_.known();
  return status;
}

}  // namespace veneer::grbl
