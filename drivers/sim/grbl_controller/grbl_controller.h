// A GRBL 1.1h controller as a state machine: bytes in, bytes out, time from outside.
//
// It behaves as the firmware does on an ATmega328 with a laser on the spindle pin: 128 bytes of receive buffer that
// overrun silently, 80 characters a line, one ok or error:N a line once the line is planned (not executed), 15 planner
// blocks with trapezoids and junction deviation, realtime bytes taken as they arrive, feed hold, door, jog, overrides,
// soft limits, homing to the upper right and negative machine coordinates after it. What the firmware does not answer
// (homing, a critical alarm, a line blocked on a full planner) this does not answer either.
//
// No I/O, no threads, no clock of its own: every call says what time it is, time never goes back. advance_to() runs all
// that happens up to then at its exact moment, however late the call comes.
//
//   controller.power_on(now);
//   on bytes from the host:      controller.receive(bytes, now); send(controller.take_output());
//   at next_event_time():        controller.advance_to(now);     send(controller.take_output());
//
// Burns go to the sink while time advances. A motion under way is burnt up to the time of the last call.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "drivers/sim/grbl_controller/burn_sink.h"
#include "drivers/sim/grbl_controller/faults.h"
#include "drivers/sim/grbl_controller/settings.h"

namespace veneer::sim {

struct GrblOptions {
  double pace_baud = 0;        // 115200: bytes take their time on the wire in both directions; 0: none
  Duration boot_time{0};       // after power_on() and a reset by the link's DTR; bytes that arrive meanwhile are lost
  bool door_pin = true;        // the lid's switch is wired to the door pin and is an interlock of the tube
  double reset_slip_mm = 0.3;  // a head that is stopped dead slides up to this far in x and y (drawn from the seed)
};

class GrblController {
 public:
  // `sink` may be null and must outlive this.
  GrblController(const GrblSettings& settings, const GrblOptions& options, std::uint64_t seed,
                 BurnSink* sink = nullptr);
  ~GrblController();
  GrblController(const GrblController&) = delete;
  GrblController& operator=(const GrblController&) = delete;

  // Reports position 0 wherever the head stands; with $22=1 in Alarm until homed. Also what a board does when its port
  // is opened and DTR resets it.
  void power_on(TimePoint now);
  void power_off(TimePoint now);  // beam dark, motion stops dead; nothing answers

  void receive(std::string_view bytes, TimePoint now);
  void advance_to(TimePoint now);
  // When something happens by itself next; nullopt when only bytes can wake it.
  std::optional<TimePoint> next_event_time() const;
  // What the host can have read by the time of the last call; emptied by asking.
  std::string take_output();

  void set_lid(bool open, TimePoint now);
  void inject(const Fault& fault);
  // False after a kUnplug fault: bytes are lost both ways. plug() mends it and resets nothing.
  bool link_up() const;
  void plug();
  void unplug(TimePoint now);

  // For the watchdog: while consent is withdrawn any motion is entered in the log. Given at the start.
  void set_consent(bool given);
  const BeamLog& beam_log() const;

  HeadPosition head() const;
  // Moves the head by hand while the motors know nothing of it (tests, and where a head stands at power-on).
  void put_head(HeadPosition at);
  bool moving() const;
  bool beam_on() const;       // the tube burns now
  double beam_power() const;  // fraction of rated power, 0 when dark
  bool homed() const;         // since power-on, and no position lost since
  std::string state() const;  // "Idle", "Run", "Hold:0", "Alarm", ... ; "Off" without power
  const GrblSettings& settings() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace veneer::sim
