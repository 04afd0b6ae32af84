// The Lihuiyu driver as a state machine: (transfers' replies, time) in, (transfers, events) out. No I/O, no clock, no
// thread of its own.
//
//   core.connect(now);        submit(core.take_output());
//   on a reply:               core.replied(reply, now);
//   at next_deadline():       core.tick(now);
//   after every call:         submit(core.take_output()); deliver(core.take_events());
//
// What it keeps to:
//  - Nothing that moves is sent but by home() and start(). connect() sends a reset, so a board left running stops.
//  - A program is sent when the one before has ended; a piece counts when the board has reported the end of its last
//    program, and not sooner than the motion can have lasted. The board reports no position and no beam.
//  - Hold sends no more packets. Each packet ends with the beam off, so the machine comes to rest dark when it has
//    burnt what it holds. (The board's own pause toggles; after a lost answer nobody would know whether it is paused.)
//  - Every doubt ends the job with a reset, repeated until the board has confirmed it: a packet of which nobody knows
//    whether it arrived, a board that stays busy, silence, no power, an end that comes too early or not at all.
//  - After an abort it does nothing until home() or connect(): where the head is, is unknown.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/laser_driver.h"
#include "drivers/lihuiyu/job_run.h"
#include "drivers/lihuiyu/lihuiyu_options.h"
#include "drivers/lihuiyu/packet_link.h"
#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

struct LihuiyuOutput {
  std::string urgent;  // a packet to write before all else; what waits or is under way is given up
  std::vector<UsbRequest> requests;
  bool close = false;  // the link is of no more use
};

class LihuiyuCore {
 public:
  explicit LihuiyuCore(const LihuiyuOptions& options = {});

  void connect(TimePoint now);  // the link is open
  void home(TimePoint now);
  void start(LaserJob job, TimePoint now);
  void hold(TimePoint now);
  void resume(TimePoint now);
  void stop_after_piece();
  void abort(TimePoint now);

  void replied(const UsbReply& reply, TimePoint now);
  void link_lost(const Error& error, TimePoint now);
  void tick(TimePoint now);

  LihuiyuOutput take_output();
  void discard_urgent() { urgent_.clear(); }  // the caller has written the reset itself
  std::vector<LaserEvent> take_events();
  TimePoint next_deadline() const;  // TimePoint::max() when nothing is awaited

  LaserStatus status() const;
  bool job_running() const { return phase_ == Phase::kJob; }

 private:
  enum class Phase { kClosed, kConfiguring, kConnecting, kReady, kResetting, kHoming, kJob };
  enum class Hold { kNone, kRequested, kHeld };

  // lihuiyu_core.cc
  void enter(Phase phase);
  void listen();
  void on_accepted();
  void on_state(BoardState state);
  void on_failure(const Error& error);
  void on_deadline();
  void begin_homing();
  void on_homing_state(BoardState state);
  void finish_connect();
  void fail(Error error);
  void drop_out(Error error, bool connected);
  // The reset packet now, and again until it is confirmed; the position is lost.
  void reset_board();

  // lihuiyu_core_job.cc
  void pump();
  void packet_accepted();
  void on_job_state(BoardState state);
  void program_ended();
  void check_hold();
  void emergency(const Error& error);
  void end_job(const Error& error);

  LihuiyuOptions options_;
  MilGrid grid_;
  PacketLink link_;
  TimePoint now_;
  Phase phase_ = Phase::kClosed;
  std::optional<TimePoint> deadline_;  // of what the phase awaits
  std::string urgent_;
  std::vector<UsbRequest> requests_;
  bool close_ = false;
  std::vector<LaserEvent> events_;

  BoardState state_ = BoardState::kReady;
  bool homed_ = false, home_wanted_ = false;
  MilPoint at_;
  TimePoint homing_quiet_at_;
  int quiet_statuses_ = 0;
  bool homing_sent_ = false;

  std::optional<JobRun> run_;
  Hold hold_ = Hold::kNone;
  bool awaiting_end_ = false;
  std::optional<TimePoint> program_begin_;
  TimePoint held_since_;
  TimePoint still_at_;  // the slowest board has burnt all it holds
};

}  // namespace veneer::lihuiyu
