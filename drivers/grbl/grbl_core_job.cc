// The part of GrblCore that runs a job.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {
namespace {

// Standing still with the beam off. "Hold:1" and "Door:2" still move.
bool at_rest(const StatusReport& report, bool lines_outstanding) {
  const bool still = report.state == "Hold:0" || report.state == "Hold" || report.state == "Door:0" ||
                     report.state == "Door:1" || (report.is("Idle") && !lines_outstanding);
  return still && report.power.value_or(0) == 0;
}

}  // namespace

Status GrblCore::may_run(const LaserJob& job) const {
  if (phase_ == Phase::kClosed || phase_ == Phase::kConnecting)
    return Error{ErrorCode::kUnavailable, "the laser is not connected"};
  if (phase_ != Phase::kReady || after_door_) return Error{ErrorCode::kConflict, "the laser is busy"};
  if (!homed_ || !position_ || !last_report_)
    return Error{ErrorCode::kRefused, "the laser does not know its position: home it first"};
  if (!at_focus())
    return Error{ErrorCode::kRefused, "the laser's head is not at the focus height: Stop, then Reset moves it there"};
  if (last_report_->state != "Idle")
    return Error{ErrorCode::kRefused,
                 fmt::format("the laser is not idle but says \"{}\": {}", last_report_->state,
                             last_report_->is("Door") ? "close the lid" : "clear it and home it first")};
  return check_job(job, settings_);
}

void GrblCore::pump() {
  if (phase_ == Phase::kJogging) return pump_jog();
  if (phase_ == Phase::kChecking) return pump_check();
  while (phase_ == Phase::kJob && hold_ == Hold::kNone) {
    const GcodeLine* line = run_->next();
    if (line == nullptr || !window_.fits(line->text)) return;
    send(*line);
    run_->sent(now_);
  }
}

void GrblCore::send(const GcodeLine& line) {
  window_.sent(line.text);
  outstanding_.push_back({line, ++lines_sent_});
  output_.bytes += line.text;
  idle_since_.reset();
}

void GrblCore::send_text(std::string text) {
  GcodeLine line;
  line.text = std::move(text);
  send(line);
}

void GrblCore::on_parser_state(const ParserState& state) {
  echo_seen_ = true;
  if (phase_ != Phase::kJob) return;
  // Answers come in order: this one belongs to the oldest $G that is unanswered.
  for (const Outstanding& waiting : outstanding_) {
    if (waiting.line.kind != LineKind::kEcho) continue;
    const GcodeLine& line = waiting.line;
    const bool burning = line.power != GcodeLine::kAny;
    const bool modes = state.has("G91") && state.has("G21") && state.has("G94") && state.has("M4");
    if (modes && std::abs(state.feed - line.feed) < 1 &&
        (!burning || (state.has(fmt::format("G{}", line.motion)) && std::abs(state.power - line.power) < 1)))
      return;
    return stop_softly(
        {ErrorCode::kDeviceFault,
         fmt::format("the laser controller understood stroke {} as \"{}\", it was sent G91 G21 G94 M4 F{}{}: check the "
                     "cable for disturbance",
                     line.stroke, state.text, line.feed,
                     burning ? fmt::format(" G{} S{}", line.motion, line.power) : "")});
  }
}

void GrblCore::on_job_report(const StatusReport& report, const std::optional<Poll>& poll) {
  if (!report.is("Idle") && !report.is("Run") && !report.is("Hold") && !report.is("Door"))
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser went into state \"{}\" in the middle of a job", report.state)});
  // The lid's interlock darkens the tube at once, the head stands still only later: what lies between is not burnt.
  if (report.is("Door") && hold_ != Hold::kHeld && position_ &&
      run_->motion().may_have_burnt((*position_)[0], (*position_)[1]))
    run_->doubt();
  follow_path(poll);
  if (phase_ != Phase::kJob) return;
  on_hold_report(report);
  if (phase_ != Phase::kJob || hold_ != Hold::kNone) return;
  if (report.is("Idle")) return on_idle_report(poll);
  idle_since_.reset();
  idle_reports_ = 0;
}

void GrblCore::follow_path(const std::optional<Poll>& poll) {
  if (!position_) return;
  const auto [x, y] = *position_;
  if (run_->motion().reported(x, y, now_)) {
    off_path_ = 0;
    emit_executed();
    // A feed that lost a digit makes a short motion last for minutes, and the beam stands almost still.
    const double late_s = poll && hold_ == Hold::kNone ? run_->motion().late_s(x, y, poll->at) : 0;
    if (late_s <= std::chrono::duration<double>(options_.late_tolerance).count()) return;
    return stop_softly({ErrorCode::kDeviceFault,
                        fmt::format("the laser is slower than it was told at ({:.3f}, {:.3f}) in its own coordinates: "
                                    "check the cable for disturbance",
                                    x, y)});
  }
  // One report may itself be garbled: another one is asked for at once.
  if (++off_path_ < 2) {
    next_poll_ = std::min(next_poll_, now_ + options_.fast_poll_period / 2);
    return;
  }
  stop_softly({ErrorCode::kDeviceFault,
               fmt::format("the laser is off its path at ({:.3f}, {:.3f}) in its own coordinates: check the cable for "
                           "disturbance",
                           x, y)});
}

void GrblCore::on_hold_report(const StatusReport& report) {
  const bool stopped = report.is("Hold") || report.is("Door");
  switch (hold_) {
    case Hold::kNone:
      if (!stopped) return;
      // The lid, or a button on the machine.
      hold_ = Hold::kRequested;
      deadline_ = now_ + options_.hold_timeout;
      [[fallthrough]];
    case Hold::kRequested:
      if (!at_rest(report, !outstanding_.empty())) return;
      hold_ = Hold::kHeld;
      deadline_.reset();
      events_.emplace_back(laser_event::Held{});
      return;
    case Hold::kHeld:
      if (report.is("Run"))
        emergency({ErrorCode::kDeviceFault, "the laser began to move while it was held: nobody asked it to"});
      return;
    case Hold::kResuming:
      if (report.state == "Door:1" || report.state == "Door:2") {  // the lid was opened again
        hold_ = Hold::kRequested;
        deadline_ = now_ + options_.hold_timeout;
        return;
      }
      if (stopped) return;
      hold_ = Hold::kNone;
      deadline_.reset();
      last_progress_ = now_;
      run_->motion().went_on(now_);
      events_.emplace_back(laser_event::Resumed{});
      return;
  }
}

void GrblCore::on_idle_report(const std::optional<Poll>& poll) {
  if (!outstanding_.empty()) {
    idle_reports_ = 0;
    if (!idle_since_) idle_since_ = now_;
    return;
  }
  idle_since_.reset();
  // An answer to a question asked before the last line was answered says nothing.
  if (!poll || !poll->nothing_outstanding || poll->lines_sent != lines_sent_) return;
  if (++idle_reports_ < 2) return;
  idle_reports_ = 0;
  verify_group();
}

void GrblCore::verify_group() {
  const WirePoint expected = run_->motion().end();
  const double dx = (*position_)[0] - static_cast<double>(expected.x_um) / 1000;
  const double dy = (*position_)[1] - static_cast<double>(expected.y_um) / 1000;
  const double tolerance = options_.position_tolerance.count();
  if (std::abs(dx) > tolerance + 0.5 / settings_.x.steps_per_mm ||
      std::abs(dy) > tolerance + 0.5 / settings_.y.steps_per_mm)
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser stands ({:.3f}, {:.3f}) mm from where the piece ends: bytes were lost or "
                                  "changed on the way; check the cable",
                                  dx, dy)});
  run_->motion().all_executed();
  emit_executed();
  if (!run_->all_sent()) return;  // the queue had run dry, nothing more
  if (run_->doubtful()) {
    reset_machine();
    return end_job({ErrorCode::kDeviceFault,
                    "the lid was opened while the beam was on, so the cut has a gap where the interlock darkened the "
                    "beam: look at the piece before the panel is moved"},
                   false);
  }
  if (const auto piece = run_->verified()) events_.emplace_back(laser_event::PieceVerified{*piece});
  if (run_->finished()) finish_job();
}

void GrblCore::finish_job() {
  const bool stopped_early = run_->stopped_early();
  run_.reset();
  enter(Phase::kReady);
  events_.emplace_back(laser_event::Done{stopped_early});
}

void GrblCore::check_progress() {
  if (hold_ != Hold::kNone) return;
  if (idle_since_ && now_ - *idle_since_ >= options_.lost_reply_timeout)
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser is idle but left {} lines unanswered, from line {} on: answers were lost",
                                  outstanding_.size(), outstanding_.front().number)});
  if (now_ - last_progress_ >= options_.stall_timeout)
    emergency({ErrorCode::kDeviceFault, "the laser neither moves nor answers lines: it is stuck"});
}

void GrblCore::emit_executed() {
  for (const std::size_t stroke : run_->motion().take_executed())
    events_.emplace_back(laser_event::StrokeExecuted{stroke});
}

void GrblCore::emergency(const Error& error) {
  reset_machine();
  end_job(phase_ == Phase::kStopping ? stop_error_ : error, true);
}

void GrblCore::stop_softly(const Error& error) {
  if (phase_ != Phase::kJob) return;
  stop_error_ = error;
  phase_ = Phase::kStopping;
  output_.bytes += '!';
  deadline_ = now_ + options_.stop_timeout;
  poll_.reset();
  next_poll_ = now_ + options_.fast_poll_period / 2;
}

void GrblCore::end_job(const Error& error, bool position_lost) {
  if (!run_) return;
  laser_event::Aborted aborted{error, run_->suspect(), position_lost};
  run_.reset();
  hold_ = Hold::kNone;
  if (position_lost) homed_ = false;
  enter(Phase::kResetting);
  next_poll_ = now_ + options_.fast_poll_period;
  events_.emplace_back(std::move(aborted));
}

}  // namespace veneer::grbl
