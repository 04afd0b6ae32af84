// The Lihuiyu driver as a state machine: (transfers' replies, time) in, (transfers, events) out. No I/O, no clock, no
// thread of its own.
//
//   core.connect(now);        submit(core.take_output());
//   on a reply:               core.replied(reply, now);
//   at next_deadline():       core.tick(now);
//   after every call:         submit(core.take_output()); deliver(core.take_events());
//
// It keeps the link (machine.h, packet_link.h) and one phase (phase.h) at a time, and brings what comes in to the
// phase. What it keeps to:
//  - Nothing that moves is sent but by home() and start(). connect() sends a reset, so a board left running stops.
//  - A program is sent when the one before has ended; a piece counts when the board has reported the end of its last
//    program, and not sooner than the motion can have lasted. The board reports no position and no beam.
//  - Hold sends no more packets. Each packet ends with the beam off, so the machine comes to rest dark when it has
//    burnt what it holds. (The board's own pause toggles; after a lost answer nobody would know whether it is paused.)
//  - Every doubt ends the job with a reset, repeated until the board has confirmed it: a packet of which nobody knows
//    whether it arrived, a board that stays busy, silence, no power, an end that comes too early or not at all.
//  - After an abort it does nothing until home() or connect(): where the head is, is unknown.
#pragma once

#include <memory>
#include <vector>

#include "drivers/lihuiyu/machine.h"
#include "drivers/lihuiyu/phase.h"

namespace veneer::lihuiyu {

class LihuiyuCore final : private PhaseHost {
 public:
  explicit LihuiyuCore(const LihuiyuOptions& options = {});

  void connect(TimePoint now);  // the link is open
  void home(TimePoint now) { at(now).home(); }
  void start(LaserJob job, TimePoint now) { at(now).start(std::move(job)); }
  void hold(TimePoint now) { at(now).hold(); }
  void resume(TimePoint now) { at(now).resume(); }
  void stop_after_piece() { phase_->stop_after_piece(); }
  void abort(TimePoint now) { at(now).abort(); }

  void replied(const UsbReply& reply, TimePoint now);
  void link_lost(const Error& error, TimePoint now) { at(now).link_lost(error); }
  void tick(TimePoint now);

  LihuiyuOutput take_output();
  void discard_urgent() { machine_.output.urgent.clear(); }  // the caller has written the reset itself
  std::vector<LaserEvent> take_events();
  TimePoint next_deadline() const;  // TimePoint::max() when nothing is awaited

  LaserStatus status() const;
  bool job_running() const { return phase_->job_running(); }

 private:
  void enter(std::unique_ptr<Phase> next) override;
  void tell(LaserEvent event) override;
  // The phase that is on, at this time. Phases that are over are gone by then.
  Phase& at(TimePoint now);
  // Brings what the link has found out to the phase.
  void listen();

  Machine machine_;
  std::vector<LaserEvent> events_;
  std::unique_ptr<Phase> phase_;
  std::vector<std::unique_ptr<Phase>> over_;
};

}  // namespace veneer::lihuiyu
