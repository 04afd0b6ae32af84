// The part of GrblCore that moves the head between jobs, dark.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {
namespace {

constexpr char kJogCancel = '\x85';

}  // namespace

Status GrblCore::jog(Millimetres dx, Millimetres dy, MmPerSecond speed, TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed || phase_ == Phase::kConnecting)
    return Error{ErrorCode::kUnavailable, "the laser is not connected"};
  if (phase_ != Phase::kReady || !last_report_ || !position_)
    return Error{ErrorCode::kConflict, "the laser is busy: it is jogged between jobs only"};
  if (last_report_->state != "Idle")
    return Error{ErrorCode::kRefused,
                 fmt::format("the laser is not idle but says \"{}\": {}", last_report_->state,
                             last_report_->is("Door") ? "close the lid and home it" : "home it first")};
  const double fastest = std::min(settings_.x.max_rate_mm_s, settings_.y.max_rate_mm_s);
  if (!(speed.count() > 0 && speed.count() <= fastest))
    return Error{ErrorCode::kInvalidArgument, fmt::format("the laser is jogged at up to {:.0f} mm/s", fastest)};
  const Box<MachineFrame> travel = settings_.travel();
  if (!(std::abs(dx.count()) <= travel.width().count() && std::abs(dy.count()) <= travel.height().count()))
    return Error{ErrorCode::kInvalidArgument, "the jog is longer than the laser's travel"};
  const auto here = settings_.from_wire((*position_)[0], (*position_)[1]);
  if (homed_ && !travel.contains({here.x + dx, here.y + dy}))
    return Error{ErrorCode::kRefused,
                 fmt::format("the jog leaves the travel: x is {:.1f} to {:.1f} mm, y is {:.1f} to {:.1f} mm",
                             travel.min.x.count(), travel.max.x.count(), travel.min.y.count(), travel.max.y.count())};
  const WirePoint from{std::llround((*position_)[0] * 1000), std::llround((*position_)[1] * 1000)};
  const WirePoint to{from.x_um + std::llround(dx.count() * 1000), from.y_um + std::llround(dy.count() * 1000)};
  jog_.emplace(JogRun{write_jog(from, to, speed, settings_, options_.longest_move_s),
                      MotionQueue({.longest_s = options_.queued_motion_s, .planner_blocks = settings_.planner_blocks}),
                      0, false, std::nullopt});
  jog_->motion.start_at(from);
  enter(Phase::kJogging);
  deadline_ = now_ + options_.stall_timeout;
  idle_reports_ = 0;
  pump_jog();
  return Ok();
}

void GrblCore::stop_jog(TimePoint now) {
  now_ = now;
  if (phase_ != Phase::kJogging) return;
  jog_->cancelled = true;
  output_.bytes += kJogCancel;
}

void GrblCore::pump_jog() {
  if (!outstanding_.empty() || jog_->all_sent() || !jog_->motion.fits(jog_->lines[jog_->next])) return;
  const GcodeLine& line = jog_->lines[jog_->next++];
  jog_->motion.sent(line, now_);
  send(line);
}

void GrblCore::on_jog_answer(std::optional<int> error_number) {
  deadline_ = now_ + options_.stall_timeout;
  jog_->motion.acknowledged(now_);
  // A line that was on its way when the jog was cancelled is a jog of its own.
  if (jog_->cancelled) output_.bytes += kJogCancel;
  if (!error_number || jog_->error) return;
  jog_->error = Error{ErrorCode::kDeviceFault, fmt::format("the laser controller refused the jog with {}",
                                                           describe_error(*error_number, settings_.family))};
  jog_->cancelled = true;
  output_.bytes += kJogCancel;
}

void GrblCore::on_jog_report(const StatusReport& report, const std::optional<Poll>& poll) {
  if (position_) jog_->motion.reported((*position_)[0], (*position_)[1], now_);
  if (report.is("Door") && report.state != "Door:2")
    return end_jog(Error{ErrorCode::kDeviceFault, "the lid was opened, so the jog ended: close it"});
  if (report.is("Alarm") || report.is("Sleep"))
    return break_jog({ErrorCode::kDeviceFault, fmt::format("the laser says \"{}\" after a jog", report.state)});
  // An answer to a question asked before the last line says nothing.
  if (!report.is("Idle") || !outstanding_.empty() || !poll || !poll->nothing_outstanding ||
      poll->lines_sent != lines_sent_) {
    idle_reports_ = 0;
    return;
  }
  jog_->motion.all_executed();
  if (!jog_->all_sent()) return pump_jog();
  if (++idle_reports_ >= 2) end_jog(jog_->error);
}

void GrblCore::end_jog(std::optional<Error> error) {
  jog_.reset();
  enter(Phase::kReady);
  events_.emplace_back(laser_event::JogEnded{std::move(error)});
}

// The reset byte now; the position is lost.
void GrblCore::break_jog(const Error& error) {
  reset_machine();
  jog_.reset();
  homed_ = false;
  enter(Phase::kResetting);
  events_.emplace_back(laser_event::JogEnded{error});
}

}  // namespace veneer::grbl
