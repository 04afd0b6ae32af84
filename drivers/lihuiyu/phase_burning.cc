// A job under way: a program is sent when the one before has ended, and counts when the board has reported its end.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "drivers/lihuiyu/job_run.h"
#include "drivers/lihuiyu/phase.h"

namespace veneer::lihuiyu {
namespace {

Duration seconds(double s) { return Duration(std::llround(s * 1e9)); }

class Burning final : public Phase {
 public:
  Burning(Machine& machine, PhaseHost& host, LaserJob job)
      : Phase(machine, host), run_(std::move(job), machine.grid, machine.options, machine.at), still_at_(machine.now) {}

  void entered() override { pump(); }
  void home() override { fail({ErrorCode::kConflict, "a job is running: stop it before homing the laser"}); }
  void hold() override {
    if (hold_ != Hold::kNone) return;
    hold_ = Hold::kRequested;
    check_hold();
  }
  void resume() override;
  void stop_after_piece() override { run_.stop_after_piece(); }
  void abort() override { emergency(stopped_by_command()); }
  void accepted() override;
  void told(BoardState state) override;
  void link_failed(const Error& error) override { emergency(error); }
  void link_lost(const Error& error) override {
    end(error);
    end_closed();
  }
  void deadline() override {
    if (awaiting_end_)
      astray({ErrorCode::kDeviceFault,
              "the laser board does not report the end of its program: switch the laser off and on, then Clear and "
              "Reset"});
  }
  void tick() override { check_hold(); }
  TimePoint next_deadline() const override {
    const TimePoint next = Phase::next_deadline();
    return hold_ == Hold::kRequested && !m_.link.sending() ? std::min(next, std::max(still_at_, m_.now)) : next;
  }
  bool job_running() const override { return true; }
  bool held() const override { return hold_ == Hold::kHeld; }
  // The board does not say; while a program burns it must be supposed.
  bool beam_supposed_on() const override { return program_begin_ && !held(); }
  MilPoint at() const override { return run_.at(); }

 private:
  enum class Hold { kNone, kRequested, kHeld };
  void pump();
  void program_ended();
  void check_hold();
  void finish();
  void emergency(const Error& error) {
    reset_board();
    end(error);
  }
  void end(const Error& error) {
    m_.homed = false;
    host_.tell(laser_event::Aborted{error, run_.suspect(), true});
  }
  // The board has not done what it was told: moves are relative, so what follows a lost one is burnt elsewhere.
  void astray(const Error& error) {
    reset_board();
    m_.homed = false;
    host_.tell(laser_event::Aborted{
        error, run_.suspect(), true, {run_.program_begin()}, Millimetres(run_.program().length_mm)});
  }

  JobRun run_;
  Hold hold_ = Hold::kNone;
  bool awaiting_end_ = false;
  std::optional<TimePoint> program_begin_;
  TimePoint held_since_;
  TimePoint still_at_;  // the slowest board has burnt all it holds
};

void Burning::resume() {
  if (hold_ != Hold::kHeld) return;
  hold_ = Hold::kNone;
  // The time held says nothing of motion.
  if (program_begin_) *program_begin_ += m_.now - held_since_;
  if (awaiting_end_) deadline_ = m_.now + m_.options.finish_timeout;
  host_.tell(laser_event::Resumed{});
  if (run_.finished()) return finish();
  pump();
}

void Burning::pump() {
  if (hold_ != Hold::kNone || m_.link.sending() || awaiting_end_) return;
  if (run_.first_of_program()) m_.link.drain();
  // Counted from here, so that the motion can only have begun later.
  if (!program_begin_) program_begin_ = m_.now;
  run_.sending();
  m_.link.send(run_.packet(), run_.may_finish(), false, m_.now);
}

void Burning::accepted() {
  double slowest_s = m_.options.packet_motion_s / m_.options.slowest_share;
  if (run_.first_of_program()) {
    // The dark way is somewhere in the first packets.
    const MilPoint from = run_.program().begin, to = run_.program().start;
    const double dark_mm = kMillimetresPerMil * static_cast<double>(std::abs(to.x - from.x) + std::abs(to.y - from.y));
    slowest_s += 1 + dark_mm / m_.options.slowest_rapid_mm_s;
  }
  still_at_ = std::max(still_at_, m_.now) + seconds(slowest_s);
  run_.accepted();
  if (run_.all_sent()) {
    awaiting_end_ = true;
    deadline_ = std::max(still_at_, m_.now) + m_.options.finish_timeout;
  }
  check_hold();
  pump();
}

void Burning::told(BoardState state) {
  if (m_.link.sending()) return;
  if (state == BoardState::kNoPower) return emergency(power_lost());
  if (state == BoardState::kFinished && awaiting_end_) program_ended();
}

void Burning::program_ended() {
  const TimePoint end = held() ? held_since_ : m_.now;
  const double lasted_s = std::chrono::duration<double>(end - *program_begin_).count();
  const double shortest_s = m_.options.earliest_share * run_.program().shortest_s;
  if (lasted_s < shortest_s)
    return astray(
        {ErrorCode::kDeviceFault,
         fmt::format("the laser board reports the end of a program after {:.1f} s that lasts at least "
                     "{:.1f} s, so it has not executed all of it: check the laser's supply and the USB cable, then "
                     "Clear and Reset",
                     lasted_s, shortest_s)});
  awaiting_end_ = false;
  deadline_.reset();
  program_begin_.reset();
  still_at_ = m_.now;
  const Program& program = run_.program();
  for (std::size_t i = 0; i < program.stroke_count; ++i)
    host_.tell(laser_event::StrokeExecuted{program.first_stroke + i});
  if (const auto piece = run_.program_ended()) host_.tell(laser_event::PieceVerified{*piece});
  // Who wants to hold is told so before the job's end, which then waits for resume().
  check_hold();
  if (hold_ != Hold::kNone) return;
  run_.finished() ? finish() : pump();
}

// Held once nothing is on its way and the slowest board has burnt what it holds.
void Burning::check_hold() {
  if (hold_ != Hold::kRequested || m_.link.sending() || m_.now < still_at_) return;
  hold_ = Hold::kHeld;
  held_since_ = m_.now;
  // Nothing moves, so the end may only come if it was reached already.
  deadline_.reset();
  host_.tell(laser_event::Held{});
}

void Burning::finish() {
  const laser_event::Done done{run_.stopped_early(), {}};
  m_.at = run_.at();
  host_.enter(ready(m_, host_));
  host_.tell(done);
}

}  // namespace

std::unique_ptr<Phase> burning(Machine& machine, PhaseHost& host, LaserJob job) {
  return std::make_unique<Burning>(machine, host, std::move(job));
}

}  // namespace veneer::lihuiyu
