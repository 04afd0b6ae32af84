// The part of GrblCore that lets the controller read a job in its check mode ($C): every line is parsed and answered,
// nothing moves, the beam stays off.
//
// No line of the job goes out before a report has said "Check": in any other state it would burn.
#include <fmt/format.h>

#include <span>
#include <utility>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {

Status GrblCore::check(LaserJob job, TimePoint now) {
  now_ = now;
  if (const Status allowed = may_run(job); !allowed.ok()) return allowed;
  CheckRun check;
  WirePoint at{std::llround((*position_)[0] * 1000), std::llround((*position_)[1] * 1000)};
  for (std::size_t begin = 0, end = 0; begin < job.strokes.size(); begin = end) {
    while (end < job.strokes.size() && job.strokes[end].piece == job.strokes[begin].piece) ++end;
    for (GcodeLine& line : write_group(std::span(job.strokes).subspan(begin, end - begin), begin, at, settings_,
                                       options_.longest_move_s)) {
      if (line.moves()) at = line.to;
      if (line.kind != LineKind::kEcho) check.lines.push_back(std::move(line));
    }
  }
  enter(Phase::kChecking);
  check_ = std::move(check);
  deadline_ = now_ + options_.stall_timeout;
  send_text("$C\n");
  return Ok();
}

void GrblCore::pump_check() {
  if (check_->step != CheckStep::kReading) return;
  for (; check_->next < check_->lines.size() && window_.fits(check_->lines[check_->next].text); ++check_->next)
    send(check_->lines[check_->next]);
  if (check_->next < check_->lines.size() || !outstanding_.empty()) return;
  check_->step = CheckStep::kLeaving;  // ends with a reset and its banner
  send_text("$C\n");
}

void GrblCore::on_check_answer(const Outstanding& answered, std::optional<int> error_number) {
  deadline_ = now_ + options_.stall_timeout;
  if (error_number) {
    std::string text = answered.line.text;
    text.pop_back();
    return fail_check(
        {ErrorCode::kDeviceFault, fmt::format("the laser controller would refuse \"{}\" of stroke {} with {}", text,
                                              answered.line.stroke, describe_error(*error_number, settings_.family))},
        false);
  }
  if (check_->step == CheckStep::kEntering) {
    check_->answered = true;
    poll_.reset();
    next_poll_ = now_;
  }
}

void GrblCore::on_check_report(const StatusReport& report) {
  if (check_->step == CheckStep::kLeaving) return;
  if (report.is("Check")) {
    if (check_->answered) check_->step = CheckStep::kReading;
    return;
  }
  // A report asked for before the controller took the command may still say Idle.
  if (check_->step == CheckStep::kEntering && !check_->answered) return;
  const bool moved = !report.is("Idle");
  fail_check({ErrorCode::kDeviceFault,
              fmt::format("the laser controller is not in its check mode but says \"{}\"", report.state)},
             moved);
}

void GrblCore::fail_check(const Error& error, bool position_lost) {
  reset_machine();
  check_.reset();
  if (position_lost) homed_ = false;
  enter(Phase::kResetting);
  fail(error);
}

}  // namespace veneer::grbl
