// A K40-class machine with a Lihuiyu M2- or M3-Nano board as a state machine: USB transfers in, replies out, time from
// outside.
//
// It behaves as far as is known (docs/LIHUIYU.md): a CH341 that must be put into EPP mode, packets of 34 bytes with a
// CRC, the board's lines as levels, a buffer of some packets, LHYMICRO-GL moved at the speeds its speed codes say. When
// the buffer runs dry the head stands and the beam stays as it was last switched. The host's transfers wait (NAK) while
// the buffer is full, the board hangs or has no supply; the lines can be asked for all the same, the chip answers.
//
// Where nothing is known it does what is worst for a careless host: an I alone stops at once and forgets everything; a
// packet that is taken clears what the lines said before.
//
// No I/O, no threads, no clock of its own: every call says what time it is, time never goes back.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "drivers/sim/grbl_controller/burn_sink.h"
#include "drivers/sim/lihuiyu_board/faults.h"
#include "drivers/sim/lihuiyu_board/gl_interpreter.h"

namespace veneer::sim {

struct BoardOptions {
  bool m3 = false;  // sets its power by command; an M2 burns with what is set at the panel
  double travel_x_mm = 300, travel_y_mm = 200;
  std::size_t buffer_packets = 8;
  double panel_power = 1;  // M2: fraction of rated power
  double rapid_mm_s = 150, homing_mm_s = 80;
  // From rest to rest takes speed / acceleration longer than at full speed; the first speed^2 / 2 acceleration are
  // slow.
  double acceleration_mm_s2 = 2500;
  double true_speed = 1;                                // of what the speed code says
  Duration boot_time = std::chrono::milliseconds(250);  // of supply and board, after power returns
  bool lid_cuts_supply = true;  // else it only holds the tube dark, which the board does not notice
  double reset_slip_mm = 0.3;   // a head that is stopped dead slides up to this far in x and y (drawn from the seed)
};

struct BoardLog : BeamLog {
  double beam_while_relay_off_s = 0;  // power commanded while the relay on the laser enable held the tube dark
  double ground_mm = 0;               // driven on against the end of the travel
  std::size_t packets = 0, rejected = 0;
};

class LihuiyuBoard {
 public:
  // `sink` may be null and must outlive this.
  LihuiyuBoard(const BoardOptions& options, std::uint64_t seed, BurnSink* sink = nullptr);

  void power_on(TimePoint now);
  void power_off(TimePoint now);

  // ---- USB, as the host's controller sees it
  enum class Answer { kTaken, kNotYet, kError };
  Answer setup(std::uint8_t request_type, std::uint8_t request, std::uint16_t value, std::uint16_t index);
  Answer write(std::uint8_t endpoint, std::string_view bytes, TimePoint now);
  // Nothing while there is nothing to read.
  std::optional<std::string> read(std::uint8_t endpoint, std::size_t most, TimePoint now);
  void transfer_given_up();  // the host cancelled the transfer that waited
  bool plugged() const { return plugged_; }
  // Counts how often it was plugged in: another number is another device to the host.
  int enumeration() const { return enumeration_; }
  void plug();
  void unplug();

  // ---- time
  void advance_to(TimePoint now);
  TimePoint advanced_to() const { return time_; }
  std::optional<TimePoint> next_event_time() const;

  // ---- by hand
  void set_lid(bool open, TimePoint now);
  void set_relay(bool on, TimePoint now);  // on the laser enable; on at the start
  void inject(const BoardFault& fault) { faults_.push_back(fault); }
  void set_consent(bool given) { consent_ = given; }

  // ---- truth
  const BoardLog& log() const { return log_; }
  const std::vector<std::string>& complaints() const { return gl_.complaints(); }
  HeadPosition head() const;  // counted from the upper right corner, as of every simulated machine
  void put_head(HeadPosition at);
  bool moving() const { return motion_.has_value(); }
  bool beam_commanded() const { return powered_ && commanded_; }
  bool beam_on() const { return burning_power() > 0; }  // the tube burns now
  double beam_power() const { return burning_power(); }
  bool homed() const { return homed_; }
  bool lid_open() const { return lid_open_; }
  std::string state() const;  // "Ready", "Run", "Home", "Pause", "Off", "Stuck"

 private:
  struct Packet {
    std::string payload;
    double stamp = 0;  // motion_time_ when it came
  };
  struct Motion {
    GlAction action;
    double from_x = 0, from_y = 0, to_x = 0, to_y = 0;  // mm from home, +y down
    double seconds = 0, done = 0;
    double stamp = 0;
  };

  Answer take_packet(std::string_view bytes, TimePoint now);
  Answer apply_fault(const BoardFault& fault, std::string& bytes, TimePoint now);
  void accept(const std::string& payload);
  void answer_status();
  std::uint8_t lines() const;
  std::optional<BoardFault> take_fault(bool packet);
  void plan();  // what to do next, until something takes time
  void begin(const GlAction& action);
  void step_to(TimePoint t);
  void move(double seconds);
  void rest(double seconds);
  void burn(double x0, double y0, double x1, double y1, double seconds);
  void stop_dead();
  void fail_supply(TimePoint now);
  bool hangs() const { return locked_ || stalled_until_.has_value(); }
  bool live() const { return powered_ && !booting_until_ && !hangs() && !paused_; }
  double burning_power() const;

  BoardOptions options_;
  BurnSink* sink_;
  std::mt19937_64 random_;
  TimePoint time_{};
  BoardLog log_;
  std::deque<BoardFault> faults_;
  bool consent_ = true;

  // The chip.
  bool plugged_ = true, epp_ = false, deaf_ = false;
  int enumeration_ = 1;
  std::deque<std::string> replies_;
  std::optional<TimePoint> replug_at_;

  // The board.
  bool powered_ = false, locked_ = false, paused_ = false, homing_ = false;
  std::optional<TimePoint> booting_until_, stalled_until_, supply_back_at_;
  bool rejected_ = false, finished_ = false, accepted_at_ = false;
  int power_permille_ = 1000;
  std::deque<Packet> buffer_;
  std::size_t next_char_ = 0;
  GlInterpreter gl_;
  std::deque<GlAction> actions_;
  double stamp_ = 0;  // of the packet the actions come from

  // The machine.
  std::optional<Motion> motion_;
  double x_ = 0, y_ = 0;
  bool at_speed_ = false;  // the head has not stood still since the last motion
  double ramp_mm_ = 0;     // of its way until it is as fast as it is told
  bool commanded_ = false, homed_ = false, lid_open_ = false, relay_on_ = true;
  double motion_time_ = 0;  // seconds of motion in compact mode
};

}  // namespace veneer::sim
