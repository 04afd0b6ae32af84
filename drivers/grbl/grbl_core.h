// The GRBL 1.1 protocol as a state machine: (bytes, time) in, (bytes, events) out. No I/O, no clock, no thread of its
// own.
//
//   core.connect(now);  write(core.take_output());
//   on bytes:           core.receive(bytes, now);
//   at next_deadline(): core.tick(now);
//   after every call:   write(core.take_output()); deliver(core.take_events());
//
// What it keeps to:
//  - Nothing that moves is sent but by home(), jog() and start(). connect() sends a reset, so a machine left running
//  stops.
//  - Never more bytes unanswered than the receive buffer holds, never more than 1.0 s of motion unexecuted.
//  - A piece counts only when its lines are answered, the machine has drained and stands idle, and the position the
//  machine
//    itself reports is the expected one.
//  - A piece over which the lid was opened is finished when the operator resumes, but never counts: it has a gap.
//  - Every doubt ends the job with a reset byte: an answer too many, an answer missing, silence, a reset nobody asked
//  for,
//    an alarm, a place off the path, a feed or power understood differently than sent.
//  - After an abort it does nothing until home() or connect().
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "drivers/grbl/gcode.h"
#include "drivers/grbl/grbl_options.h"
#include "drivers/grbl/job_run.h"
#include "drivers/grbl/motion_queue.h"
#include "drivers/grbl/overrides.h"
#include "drivers/grbl/reply.h"
#include "drivers/grbl/send_window.h"
#include "drivers/grbl/settings.h"
#include "drivers/laser_driver.h"

namespace veneer::grbl {

struct GrblOutput {
  std::string urgent;  // before all else, and what waits unsent is to be dropped
  std::string bytes;
  bool close = false;  // the link is of no more use
};

class GrblCore {
 public:
  explicit GrblCore(const GrblOptions& options = {});

  void connect(TimePoint now);  // the link is open
  void home(TimePoint now);
  void start(LaserJob job, TimePoint now);
  void hold(TimePoint now);
  void resume(TimePoint now);
  void stop_after_piece();
  void abort(TimePoint now);
  Status check(LaserJob job, TimePoint now);
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed, TimePoint now);
  void stop_jog(TimePoint now);
  Status set_overrides(const LaserOverrides& overrides, TimePoint now);

  void receive(std::string_view bytes, TimePoint now);
  void link_lost(const Error& error, TimePoint now);
  void tick(TimePoint now);

  GrblOutput take_output();
  void discard_urgent() { output_.urgent.clear(); }  // the caller has sent the reset itself
  std::vector<LaserEvent> take_events();
  TimePoint next_deadline() const;  // TimePoint::max() when nothing is awaited

  LaserStatus status() const;
  bool job_running() const { return phase_ == Phase::kJob || phase_ == Phase::kStopping; }
  // At the speed the machine runs at now; an override that is wanted but not taken counts only for what is sent next.
  double queued_motion_s() const {
    return run_ ? run_->motion().queued_s() * overrides_.slowest_wanted() / overrides_.slowest() : 0;
  }

 private:
  enum class Phase { kClosed, kConnecting, kReady, kResetting, kHoming, kJogging, kChecking, kJob, kStopping };
  enum class ConnectStep { kWake, kBuildInfo, kSettings, kParserState, kStatus };
  enum class CheckStep { kEntering, kReading, kLeaving };
  enum class Hold { kNone, kRequested, kHeld, kResuming };
  struct Outstanding {
    GcodeLine line;
    std::size_t number = 0;
  };
  // A job the controller reads in its check mode.
  struct CheckRun {
    std::vector<GcodeLine> lines;
    std::size_t next = 0;
    CheckStep step = CheckStep::kEntering;
    bool answered = false;  // the line that enters check mode
  };
  // A way of the head between jobs. One line is unanswered at a time, so that a cancel leaves none behind.
  struct JogRun {
    std::vector<GcodeLine> lines;
    MotionQueue motion;
    std::size_t next = 0;
    bool cancelled = false;
    std::optional<Error> error;
    bool all_sent() const { return cancelled || next == lines.size(); }
  };
  struct Poll {
    TimePoint at;
    bool nothing_outstanding = false;
    std::size_t lines_sent = 0;
  };

  // grbl_core.cc: what comes in, and time
  void handle(const Reply& reply);
  void on_answer(std::optional<int> error_number);
  void on_alarm(int number);
  void on_banner(const Banner& banner);
  void on_report(const StatusReport& report);
  void on_parser_state(const ParserState& state);
  void on_deadline();
  void on_settled();
  void on_silence();
  void poll_if_due();
  bool polling() const;
  Duration poll_period() const;

  // grbl_core_ready.cc: getting ready
  void enter(Phase phase);
  void connect_step(ConnectStep step);
  void on_connect_answer(std::optional<int> error_number);
  void finish_connect();
  void begin_homing();
  void on_homing_answer(std::optional<int> error_number);
  void finish_homing();
  void fail(Error error);
  bool at_focus() const;
  void drop_out(Error error, bool connected);
  void reset_machine();

  void drive_overrides();

  // grbl_core_check.cc: a job read in check mode
  void pump_check();
  void on_check_answer(const Outstanding& answered, std::optional<int> error_number);
  void on_check_report(const StatusReport& report);
  void fail_check(const Error& error, bool position_lost);

  // grbl_core_jog.cc: moving by hand
  void pump_jog();
  void on_jog_answer(std::optional<int> error_number);
  void on_jog_report(const StatusReport& report, const std::optional<Poll>& poll);
  void end_jog(std::optional<Error> error);
  void break_jog(const Error& error);

  // grbl_core_job.cc: a job under way
  Status may_run(const LaserJob& job) const;
  void pump();
  void send(const GcodeLine& line);
  void send_text(std::string text);
  void on_job_report(const StatusReport& report, const std::optional<Poll>& poll);
  void follow_path(const std::optional<Poll>& poll);
  void on_hold_report(const StatusReport& report);
  void on_idle_report(const std::optional<Poll>& poll);
  void verify_group();
  void finish_job();
  void check_progress();
  void emit_executed();
  // The reset byte now; the position is lost.
  void emergency(const Error& error);
  // Feed hold, then the reset byte once the machine stands still; the position is kept.
  void stop_softly(const Error& error);
  void end_job(const Error& error, bool position_lost);

  GrblOptions options_;
  TimePoint now_;
  Phase phase_ = Phase::kClosed;
  ConnectStep connect_step_ = ConnectStep::kWake;
  TimePoint phase_begin_;
  std::optional<TimePoint> deadline_;    // of what the phase awaits
  std::optional<TimePoint> settled_at_;  // the controller has come out of a reset and is left alone until then

  LineReader reader_;
  SendWindow window_;
  std::deque<Outstanding> outstanding_;
  std::size_t lines_sent_ = 0;
  GrblOutput output_;
  std::vector<LaserEvent> events_;

  std::optional<Poll> poll_;
  TimePoint next_poll_;
  int polls_lost_ = 0;
  std::optional<TimePoint> silent_since_;

  SettingsReader settings_reader_;
  MachineSettings settings_;
  std::optional<StatusReport> last_report_;
  std::optional<StatusReport::Xy> position_;     // machine coordinates on the wire, mm
  std::optional<StatusReport::Xy> work_offset_;  // cached: reports carry it only now and then
  std::optional<double> z_, offset_z_;           // of the same
  bool homed_ = false;
  bool home_wanted_ = false;
  std::optional<LaserJob> after_door_;  // to begin once the controller has woken from a lid that was closed again
  bool homing_answered_ = false;
  bool focusing_ = false;  // homed, on the way to the focus height

  Overrides overrides_;
  std::optional<CheckRun> check_;
  std::optional<JogRun> jog_;
  std::optional<JobRun> run_;
  Hold hold_ = Hold::kNone;
  bool echo_seen_ = false;
  int off_path_ = 0;
  int idle_reports_ = 0;
  std::optional<TimePoint> idle_since_;  // idle with lines unanswered
  TimePoint last_progress_;
  Error stop_error_;
};

}  // namespace veneer::grbl
