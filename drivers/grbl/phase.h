// What the driver is about with its controller, one object per phase: how it takes answers, alarms, banners, reports
// and deadlines, and which commands.
//
//   closed -> connecting -> ready <-> homing, waking -> burning -> stopping, jogging, checking
//                any but closed -> resetting -> ready;  any -> closed
//
// A phase that goes over into another one calls PhaseHost::enter() last and returns: it lives until its call is over.
// Pure; not thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/grbl/job_run.h"
#include "drivers/grbl/machine.h"

namespace veneer::grbl {

class Phase;

class PhaseHost {
 public:
  virtual void enter(std::unique_ptr<Phase> next) = 0;
  virtual void tell(LaserEvent event) = 0;

 protected:
  ~PhaseHost() = default;
};

class Phase {
 public:
  Phase(Machine& machine, PhaseHost& host) : m_(machine), host_(host), begin_(machine.now) {}
  virtual ~Phase() = default;
  Phase(const Phase&) = delete;
  Phase& operator=(const Phase&) = delete;

  // The host has let it in.
  virtual void entered() { m_.ask(); }

  // ---- commands; what a phase has no use for is refused, or nothing
  virtual void home() = 0;
  virtual void start(LaserJob&& job);
  virtual Status check(const LaserJob& job);
  virtual Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed);
  virtual void stop_jog() {}
  virtual void hold() {}
  virtual void resume() {}
  virtual void stop_after_piece() {}
  virtual void abort() = 0;
  virtual Status set_overrides(const LaserOverrides& overrides);
  virtual Status corner_is_here();

  // ---- what comes in
  virtual void answered(const Outstanding& line, std::optional<int> error) {
    static_cast<void>(line), static_cast<void>(error);
  }
  // An answer to nothing, or lines that were miscounted.
  virtual void count_lost(const Error& error) { static_cast<void>(error); }
  virtual void alarm(int number) = 0;
  virtual void banner(const Banner& banner) = 0;
  virtual void reported(const StatusReport& report, const Heard& heard) {
    static_cast<void>(report), static_cast<void>(heard);
  }
  virtual void modes_told(const ParserState& state) { static_cast<void>(state); }
  // Ends in the closed phase, but for what has no link yet.
  virtual void link_lost(const Error& error) = 0;

  // Is there anybody to listen to?
  virtual bool listens() const { return true; }

  // ---- time
  virtual void deadline() {}
  virtual void settled() {}
  virtual void tick() {}
  virtual void pump() {}
  void serve_deadline() {
    if (due(deadline_)) deadline();
  }
  void serve_settled() {
    if (due(settled_at_)) settled();
  }
  virtual TimePoint next_deadline() const;
  virtual bool polls() const { return true; }
  virtual Duration poll_period() const { return m_.options.fast_poll_period; }
  // Does silence end the link?
  virtual bool minds_silence() const { return true; }

  virtual bool connected() const { return true; }
  virtual bool job_running() const { return false; }
  virtual double queued_motion_s() const { return 0; }

 protected:
  static Error busy() { return {ErrorCode::kConflict, "the laser is busy"}; }
  // Whoever asked for homing is Aborted by its failure.
  static Error busy_for_homing() {
    return {ErrorCode::kConflict, "the laser is busy: wait until it stands still, then Clear and Reset"};
  }
  static Error busy_for_jogs() {
    return {ErrorCode::kConflict, "the laser is busy, and is jogged between jobs only: wait until it stands still"};
  }
  Error no_corner_now() const;
  void fail(Error error) { host_.tell(laser_event::Failed{std::move(error)}); }
  // The position is no longer known, and no job is there that would say so.
  void drop_out(Error error, bool still_connected);
  // The reset byte now, and then nothing until the controller has come back.
  void reset();
  std::string alarm_words(int number) const;
  // Nobody asked for this banner: what was known of the place is gone.
  Error reset_by_others();
  bool due(std::optional<TimePoint>& at) const;

  Machine& m_;
  PhaseHost& host_;
  const TimePoint begin_;
  std::optional<TimePoint> deadline_;    // of what the phase awaits
  std::optional<TimePoint> settled_at_;  // the controller has come out of a reset and is left alone until then
};

std::unique_ptr<Phase> closed(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> connecting(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> ready(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> resetting(Machine& machine, PhaseHost& host, bool then_home = false);
std::unique_ptr<Phase> homing(Machine& machine, PhaseHost& host);
// A panel is laid through the lid: closed again, the controller waits for a cycle start with nothing left to do. The
// job, or the jog, begins when it has come out of that.
struct JogWay {
  Millimetres dx{0}, dy{0};
  MmPerSecond speed{0};
};
std::unique_ptr<Phase> waking(Machine& machine, PhaseHost& host, LaserJob job);
std::unique_ptr<Phase> waking(Machine& machine, PhaseHost& host, JogWay way);
// `job` has passed job_allowed().
std::unique_ptr<Phase> burning(Machine& machine, PhaseHost& host, LaserJob job);
std::unique_ptr<Phase> jogging(Machine& machine, PhaseHost& host, std::vector<GcodeLine> lines);
std::unique_ptr<Phase> checking(Machine& machine, PhaseHost& host, LaserJob job);

// The lines of a jog, or why it may not go, whatever the controller says of its state.
Result<std::vector<GcodeLine>> jog_lines(const Machine& machine, const JogWay& way);

// May this job begin on a machine that is ready?
Status job_allowed(const Machine& machine, const LaserJob& job);

inline Error stopped_by_command() { return {ErrorCode::kCancelled, "the laser was stopped by command"}; }

}  // namespace veneer::grbl
