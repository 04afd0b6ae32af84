// Moving the head between jobs, dark. One line is unanswered at a time, so that a cancel leaves none behind.
#include <fmt/format.h>

#include <utility>

#include "drivers/grbl/phase.h"
#include "drivers/overdue.h"

namespace veneer::grbl {
namespace {

constexpr char kJogCancel = '\x85';

class Jogging final : public Phase {
 public:
  Jogging(Machine& machine, PhaseHost& host, std::vector<GcodeLine> lines)
      : Phase(machine, host),
        lines_(std::move(lines)),
        motion_({.longest_s = m_.options.queued_motion_s, .planner_blocks = m_.settings.planner_blocks}) {
    motion_.start_at(*m_.place());
  }

  void entered() override {
    m_.ask();
    wait_on();
    pump();
  }
  void home() override { fail(busy_for_homing()); }
  void stop_jog() override {
    cancelled_ = true;
    m_.realtime(kJogCancel);
  }
  void abort() override { break_off(stopped_by_command()); }
  // They wait until the head rests.
  Status set_overrides(const LaserOverrides& overrides) override { return m_.overrides.want(overrides); }
  void answered(const Outstanding& line, std::optional<int> error) override;
  void alarm(int number) override { break_off({ErrorCode::kDeviceFault, alarm_words(number)}); }
  void banner(const Banner&) override { break_off(reset_by_others()); }
  void reported(const StatusReport& report, const Heard& heard) override;
  void link_lost(const Error& error) override {
    drop_out(error, false);
    host_.enter(closed(m_, host_));
  }
  void deadline() override {
    break_off({ErrorCode::kDeviceFault,
               overdue_words("the laser neither moves nor answers while it is jogged", "Clear and Reset")});
  }
  void pump() override {
    if (!m_.outstanding().empty() || all_sent() || !motion_.fits(lines_[next_])) return;
    const GcodeLine& line = lines_[next_++];
    motion_.sent(line, m_.now);
    m_.send(line);
  }

 private:
  bool all_sent() const { return cancelled_ || next_ == lines_.size(); }
  void wait_on() { deadline_ = m_.now + m_.options.stall_timeout; }
  void end(std::optional<Error> error) {
    host_.enter(ready(m_, host_));
    host_.tell(laser_event::JogEnded{std::move(error)});
  }
  // The reset byte now; the position is lost.
  void break_off(const Error& error) {
    m_.homed = false;
    reset();
    host_.tell(laser_event::JogEnded{error});
  }

  std::vector<GcodeLine> lines_;
  MotionQueue motion_;
  std::size_t next_ = 0;
  bool cancelled_ = false;
  int idle_reports_ = 0;
  std::optional<Error> error_;
};

void Jogging::answered(const Outstanding&, std::optional<int> error) {
  wait_on();
  motion_.acknowledged(m_.now);
  // A line that was on its way when the jog was cancelled is a jog of its own.
  if (cancelled_) m_.realtime(kJogCancel);
  if (!error || error_) return;
  error_ = Error{ErrorCode::kDeviceFault, fmt::format("the laser controller refused the jog with {}",
                                                      describe_error(*error, m_.settings.family))};
  stop_jog();
}

void Jogging::reported(const StatusReport& report, const Heard& heard) {
  if (heard.moved) wait_on();
  if (m_.position()) motion_.reported((*m_.position())[0], (*m_.position())[1], m_.now);
  if (report.is("Door") && report.state != "Door:2")
    return end(Error{ErrorCode::kDeviceFault, "the lid was opened, so the jog ended: close it"});
  if (report.is("Alarm") || report.is("Sleep"))
    return break_off({ErrorCode::kDeviceFault, fmt::format("the laser says \"{}\" after a jog", report.state)});
  // An answer to a question asked before the last line says nothing.
  const auto& poll = heard.poll;
  if (!report.is("Idle") || !m_.outstanding().empty() || !poll || !poll->nothing_outstanding ||
      poll->lines_sent != m_.lines_sent()) {
    idle_reports_ = 0;
    return;
  }
  motion_.all_executed();
  if (!all_sent()) return pump();
  if (++idle_reports_ >= 2) end(error_);
}

}  // namespace

std::unique_ptr<Phase> jogging(Machine& machine, PhaseHost& host, std::vector<GcodeLine> lines) {
  return std::make_unique<Jogging>(machine, host, std::move(lines));
}

}  // namespace veneer::grbl
