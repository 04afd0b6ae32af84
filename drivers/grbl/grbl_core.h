// The GRBL 1.1 protocol as a state machine: (bytes, time) in, (bytes, events) out. No I/O, no clock, no thread of its
// own.
//
//   core.connect(now);  write(core.take_output());
//   on bytes:           core.receive(bytes, now);
//   at next_deadline(): core.tick(now);
//   after every call:   write(core.take_output()); deliver(core.take_events());
//
// It keeps the link (machine.h) and one phase (phase.h) at a time, and brings what comes in to the phase. What it keeps
// to:
//  - Nothing that moves is sent but by home(), jog() and start(). connect() sends a reset, so a machine left running
//    stops.
//  - Never more bytes unanswered than the receive buffer holds, never more than 1.0 s of motion unexecuted.
//  - A piece counts only when its lines are answered, the machine has drained and stands idle, and the position the
//    machine itself reports is the expected one.
//  - A piece over which the lid was opened is finished when the operator resumes, but never counts: it may have a gap.
//  - Every doubt ends the job with a reset byte: an answer too many, an answer missing, silence, a reset nobody asked
//    for, an alarm, a place off the path, a feed or power understood differently than sent.
//  - After an abort it does nothing until home() or connect().
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "drivers/grbl/machine.h"
#include "drivers/grbl/phase.h"

namespace veneer::grbl {

class GrblCore final : private PhaseHost {
 public:
  explicit GrblCore(const GrblOptions& options = {});

  void connect(TimePoint now);  // the link is open
  void home(TimePoint now) { at(now).home(); }
  void start(LaserJob job, TimePoint now) { at(now).start(std::move(job)); }
  void hold(TimePoint now) { at(now).hold(); }
  void resume(TimePoint now) { at(now).resume(); }
  void stop_after_piece() { phase_->stop_after_piece(); }
  void abort(TimePoint now) { at(now).abort(); }
  Status check(const LaserJob& job, TimePoint now) { return at(now).check(job); }
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed, TimePoint now) { return at(now).jog(dx, dy, speed); }
  void stop_jog(TimePoint now) { at(now).stop_jog(); }
  Status set_overrides(const LaserOverrides& overrides, TimePoint now) { return at(now).set_overrides(overrides); }
  Status corner_is_here(TimePoint now) { return at(now).corner_is_here(); }

  void receive(std::string_view bytes, TimePoint now);
  void link_lost(const Error& error, TimePoint now) { at(now).link_lost(error); }
  void tick(TimePoint now);

  GrblOutput take_output() { return machine_.take_output(); }
  void discard_urgent() { machine_.discard_urgent(); }  // the caller has sent the reset itself
  std::vector<LaserEvent> take_events();
  TimePoint next_deadline() const;  // TimePoint::max() when nothing is awaited

  LaserStatus status() const;
  bool job_running() const { return phase_->job_running(); }
  double queued_motion_s() const { return phase_->queued_motion_s(); }

 private:
  void enter(std::unique_ptr<Phase> next) override;
  void tell(LaserEvent event) override;
  // The phase that is on, at this time. Phases that are over are gone by then.
  Phase& at(TimePoint now);
  void handle(const Reply& reply);
  void ask();

  Machine machine_;
  LineReader reader_;
  std::vector<LaserEvent> events_;
  std::unique_ptr<Phase> phase_;
  std::vector<std::unique_ptr<Phase>> over_;
};

}  // namespace veneer::grbl
