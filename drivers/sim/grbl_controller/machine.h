// The inside of GrblController: wire, line protocol, state machine, beam. Split over machine.cc (time, motion, beam),
// line_protocol.cc (bytes, lines, $-commands) and report.cc (what it says).
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/grbl_controller/gcode.h"
#include "drivers/sim/grbl_controller/grbl_controller.h"
#include "drivers/sim/grbl_controller/motion.h"

namespace veneer::sim {

class GrblController::Impl {
 public:
  Impl(const GrblSettings& settings, const GrblOptions& options, std::uint64_t seed, BurnSink* sink);

  void power_on(TimePoint now);
  void power_off(TimePoint now);
  void receive(std::string_view bytes, TimePoint now);
  void advance_to(TimePoint now);
  std::optional<TimePoint> next_event_time() const;
  std::string take_output();
  void set_lid(bool open, TimePoint now);

  bool beam_on() const { return powered_ && beam_power() > 0 && !interlocked(); }
  double beam_power() const;
  bool moving() const;
  std::string state_name() const;
  HeadPosition head() const;
  void put_head(HeadPosition at);

  GrblSettings settings_;
  GrblOptions options_;
  BurnSink* sink_;
  BeamLog log_;
  std::deque<Fault> faults_;
  bool link_up_ = true;
  bool consent_ = true;
  bool homed_ = false;

 private:
  enum class State { kIdle, kAlarm, kCheck, kHoming, kCycle, kHold, kJog, kDoor, kSleep };

  // machine.cc
  void step_to(TimePoint t);
  void move(double seconds);
  void account_motion(double mm, bool burning);
  void rest(double seconds);
  void entered_rest();
  void burn(const HeadPosition& from, const HeadPosition& to, double power_seconds, TimePoint start, double seconds);
  void settle();  // starts what can start, once the line reader waits
  void begin_hold();
  void resume();
  void begin_door();
  void begin_homing();
  void finish_homing();
  void kill_motion();  // stepper interrupt off, beam dark at once
  void soft_reset();
  void restart();  // the main program from its top: parser, planner, banner
  void raise_alarm(int code, bool critical);
  void set_overrides(int feed, int rapid, int spindle);
  bool suspended() const { return state_ == State::kHold || state_ == State::kDoor || state_ == State::kSleep; }
  bool interlocked() const { return options_.door_pin && lid_open_; }
  bool dead() const { return !powered_ || stalled_; }
  double power_of(double s) const;
  double moving_s() const;

  // line_protocol.cc
  void arrive(char c);
  bool realtime(unsigned char c);
  void override_byte(unsigned char c);
  void run();
  bool run_action();
  bool run_synced(const gcode::Action& action);
  void set_spindle(SpindleMode mode, double s);
  void finish_line();
  void take_char(char c);
  void line_complete();
  void execute_line(const std::string& line);
  int system_command(const std::string& line);
  int idle_command(const std::string& line);
  int jog_command(const std::string& line);
  int store_setting(const std::string& line);
  int home_command();
  bool line_fault();
  bool try_line(const gcode::Line& line);
  std::optional<Fault> take_fault(std::initializer_list<FaultKind> kinds);

  // report.cc
  void say(std::string_view text);
  void reply(int error);
  void banner();
  void status_report();

  std::mt19937_64 random_;
  TimePoint time_{};
  bool powered_ = false;
  bool stalled_ = false;
  std::optional<TimePoint> boot_until_;

  State state_ = State::kIdle;
  bool hold_complete_ = false;
  bool jog_cancel_ = false;
  bool soft_limit_ = false;  // a line out of bounds waits for the motion to end
  bool critical_ = false;    // spins until reset, answers nothing
  bool lid_open_ = false;
  std::optional<TimePoint> homing_until_;
  bool status_pending_ = false;
  std::optional<TimePoint> deaf_until_;  // EEPROM is written

  Motion motion_;
  GcodeInterpreter gcode_;
  HeadPosition slip_{};  // head = reported position + slip
  SpindleMode spindle_ = SpindleMode::kOff;
  double rest_s_ = 0;             // S the pin carries while nothing moves
  double held_s_ = 0;             // what rest_s_ was before a hold
  bool spindle_stopped_ = false;  // by a hold
  bool flood_ = false;
  int feed_override_ = 100;
  int rapid_override_ = 100;
  int spindle_override_ = 100;

  // The wire and the line reader.
  struct WireByte {
    TimePoint at;
    char c;
  };
  struct WireText {
    TimePoint at;
    std::string text;
  };
  std::deque<WireByte> wire_in_;
  std::deque<WireText> wire_out_;
  TimePoint wire_in_free_{};
  TimePoint wire_out_free_{};
  std::string ready_;
  std::deque<char> ring_;
  std::deque<double> newline_stamps_;  // run_time_ at which each newline in ring_ arrived
  std::string line_;
  bool overflow_ = false;
  char comment_ = 0;
  double line_stamp_ = 0;
  double run_time_ = 0;  // seconds, standing still during holds

  std::vector<gcode::Action> actions_;
  std::size_t next_action_ = 0;
  bool line_open_ = false;  // actions of a line are under way, its ok is owed
  bool jogging_line_ = false;
  double dwell_left_ = -1;
  bool paused_ = false;

  int wco_counter_ = 0;
  int override_counter_ = 0;
  Vec3 reported_wco_{};
  std::vector<std::string> startup_lines_{"", ""};
};

}  // namespace veneer::sim
