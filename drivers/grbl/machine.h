// The link to a controller, and what is known of the machine behind it: lines within the send window, answers matched
// to them, status questions, place, settings, overrides, lid. What any of it means for what the driver is about is the
// phases' business (phase.h).
//
// Pure; not thread-safe.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "base/clock.h"
#include "drivers/grbl/gcode.h"
#include "drivers/grbl/given_corner.h"
#include "drivers/grbl/grbl_options.h"
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

// A line that waits for its answer.
struct Outstanding {
  GcodeLine line;
  std::size_t number = 0;  // counted from the connection
};

// A status question that waits for its report.
struct Poll {
  TimePoint at;
  bool nothing_outstanding = false;  // when it was asked
  std::size_t lines_sent = 0;
};

// What a report meant besides its own words.
struct Heard {
  std::optional<Poll> poll;  // the question it answers
  bool moved = false;        // since the report before
  bool overrides_by_others = false;
};

class Machine {
 public:
  explicit Machine(const GrblOptions& machine_options) : options(machine_options) {}

  const GrblOptions options;
  TimePoint now;
  MachineSettings settings;
  SettingsReader settings_reader;  // while it connects
  Overrides overrides;
  GivenCorner corner;
  bool homed = false;
  bool modes_told = false;  // a [GC:...] has come

  // A new link: nothing is known but what an operator has said of the corner.
  void start_anew();
  // The link is gone; what was known of the machine's place and settings is kept for whoever asks.
  void disconnected();

  // ---- to the controller
  bool fits(const GcodeLine& line) const { return window_.fits(line.text); }
  void send(const GcodeLine& line);
  void send_text(std::string text);
  void realtime(char byte) { output_.bytes += byte; }
  // The reset byte: no answer to anything sent before will come.
  void reset();
  void close_link() { output_.close = true; }
  void use_window_of(const MachineSettings& s) { window_ = SendWindow(s.receive_bytes); }
  GrblOutput take_output();
  void discard_urgent() { output_.urgent.clear(); }
  // The next step of the overrides, unless a report on its way may still tell of the time before it.
  void step_overrides();

  // ---- answers
  const std::deque<Outstanding>& outstanding() const { return outstanding_; }
  std::size_t lines_sent() const { return lines_sent_; }
  // The oldest line is answered. kDeviceFault when none was outstanding.
  Result<Outstanding> answered();
  // A banner: the controller was reset.
  void forget_lines();

  // ---- status questions
  void ask(Duration in = {}) { next_poll_ = now + in; }
  void ask_soon(Duration in = {}) { next_poll_ = std::min(next_poll_, now + in); }
  void ask_not_before(Duration in) { next_poll_ = std::max(next_poll_, now + in); }
  // An answer on its way does not count any more.
  void ask_afresh(Duration in = {});
  bool asking() const { return poll_.has_value(); }
  void ask_if_due(Duration period);
  // The controller has left too many questions unanswered, or for too long. Said once.
  bool fell_silent();
  TimePoint next_poll_deadline() const;
  TimePoint silence_deadline() const;

  // ---- reports
  Heard heard(const StatusReport& report);
  const std::optional<StatusReport>& report() const { return report_; }
  const std::optional<StatusReport::Xy>& position() const { return position_; }  // machine coordinates on the wire, mm
  std::optional<WirePoint> place() const;
  bool says(std::string_view state) const { return report_ && report_->is(state); }
  bool lid_open() const { return report_ && lid_is_open(*report_); }
  bool at_focus() const;

  // The part of LaserStatus that comes from the machine.
  LaserStatus status() const;

 private:
  void count_lid(const StatusReport& report);
  void follow(const StatusReport& report);

  SendWindow window_;
  std::deque<Outstanding> outstanding_;
  std::size_t lines_sent_ = 0;
  GrblOutput output_;

  std::optional<Poll> poll_;
  TimePoint next_poll_;
  int polls_lost_ = 0;
  std::optional<TimePoint> silent_since_;

  std::optional<StatusReport> report_;
  std::optional<StatusReport::Xy> position_;
  std::optional<StatusReport::Xy> work_offset_;  // cached: reports carry it only now and then
  std::optional<double> z_, offset_z_;           // of the same
  int lid_openings_ = 0;
  bool lid_seen_ = false;  // the controller has told of a lid
};

}  // namespace veneer::grbl
