// Letting the controller read a job in its check mode ($C): every line is parsed and answered, nothing moves, the beam
// stays off.
//
// No line of the job goes out before a report has said "Check": in any other state it would burn.
#include <fmt/format.h>

#include <span>
#include <utility>

#include "drivers/grbl/phase.h"
#include "drivers/overdue.h"
#include "drivers/stroke_groups.h"

namespace veneer::grbl {
namespace {

class Checking final : public Phase {
 public:
  Checking(Machine& machine, PhaseHost& host, LaserJob job)
      : Phase(machine, host), job_(std::move(job)), at_(*m_.place()) {}

  void entered() override {
    m_.ask();
    wait_on();
    m_.send_text("$C\n");
  }
  void home() override { fail(busy_for_homing()); }
  void abort() override { break_off(stopped_by_command(), false); }
  void answered(const Outstanding& line, std::optional<int> error) override;
  void alarm(int number) override { break_off({ErrorCode::kDeviceFault, alarm_words(number)}, true); }
  void banner(const Banner&) override {
    if (step_ == Step::kLeaving) {
      settled_at_ = m_.now + m_.options.settle_time;
      return;
    }
    break_off(reset_by_others(), true);
  }
  void settled() override {
    host_.enter(ready(m_, host_));
    host_.tell(laser_event::Checked{});
  }
  void reported(const StatusReport& report, const Heard& heard) override;
  void link_lost(const Error& error) override {
    fail(error);
    m_.homed = false;
    host_.enter(closed(m_, host_));
  }
  void deadline() override {
    break_off({ErrorCode::kDeviceFault,
               overdue_words("the laser controller stopped answering in its check mode", "try again")},
              false);
  }
  void pump() override;

 private:
  enum class Step { kEntering, kReading, kLeaving };
  void wait_on() { deadline_ = m_.now + m_.options.stall_timeout; }
  void break_off(const Error& error, bool position_lost) {
    if (position_lost) m_.homed = false;
    reset();
    fail(error);
  }

  // Writes the next group when the one before is out. False when there is none.
  bool next_group();

  LaserJob job_;
  StrokeGroup group_;
  WirePoint at_;
  std::vector<GcodeLine> lines_;  // of the group
  std::size_t next_ = 0;
  Step step_ = Step::kEntering;
  bool answered_ = false;  // the line that enters check mode
};

void Checking::pump() {
  if (step_ != Step::kReading) return;
  while (next_ < lines_.size() || next_group()) {
    if (!m_.fits(lines_[next_])) return;
    m_.send(lines_[next_++]);
  }
  if (!m_.outstanding().empty()) return;
  step_ = Step::kLeaving;  // ends with a reset and its banner
  m_.send_text("$C\n");
}

bool Checking::next_group() {
  group_ = group_from(job_, group_.end);
  if (group_.empty()) return false;
  next_ = 0;
  lines_ = write_group(strokes_of(job_, group_), group_.begin, at_, m_.settings, m_.options.longest_move_s);
  for (const GcodeLine& line : lines_)
    if (line.moves()) at_ = line.to;
  std::erase_if(lines_, [](const GcodeLine& line) { return line.kind == LineKind::kEcho; });
  return true;
}

void Checking::answered(const Outstanding& line, std::optional<int> error) {
  wait_on();
  if (error) {
    std::string text = line.line.text;
    text.pop_back();
    return break_off(
        {ErrorCode::kDeviceFault, fmt::format("the laser controller would refuse \"{}\" of stroke {} with {}", text,
                                              line.line.stroke, describe_error(*error, m_.settings.family))},
        false);
  }
  if (step_ != Step::kEntering) return;
  answered_ = true;
  m_.ask_afresh();
}

void Checking::reported(const StatusReport& report, const Heard&) {
  if (step_ == Step::kLeaving) return;
  if (report.is("Check")) {
    if (answered_) step_ = Step::kReading;
    return;
  }
  // A report asked for before the controller took the command may still say Idle.
  if (step_ == Step::kEntering && !answered_) return;
  break_off({ErrorCode::kDeviceFault,
             fmt::format("the laser controller is not in its check mode but says \"{}\"", report.state)},
            !report.is("Idle"));
}

}  // namespace

std::unique_ptr<Phase> checking(Machine& machine, PhaseHost& host, LaserJob job) {
  return std::make_unique<Checking>(machine, host, std::move(job));
}

}  // namespace veneer::grbl
