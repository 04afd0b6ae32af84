// Understands LHYMICRO-GL as a Lihuiyu board does: characters in, actions out, in order. Its own reading of the
// language, sharing nothing with the driver that writes it.
//
// Distances add up on the engaged axes. In compact mode every command letter first moves what has added up; in default
// mode N, S and P do, with the directions that hold then. After a program's end everything is ignored until the next I.
//
// Pure; not thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::sim {

// What a speed code says, before it is turned into time.
struct SpeedWord {
  int timer = 0;  // reload value of the step timer, 16 bits
  int acceleration = 1;
  int diagonal_steps = 0, diagonal_timer = 0;
  bool coarse = false;  // a C at the end
  friend bool operator==(const SpeedWord&, const SpeedWord&) = default;

  double step_seconds() const;      // a step in x or y
  double diagonal_seconds() const;  // a step in both
};

struct GlAction {
  enum class Kind {
    kMove,    // of (dx, dy) mils; in compact mode at `speed`, else rapid
    kHome,    // to the limit switches
    kFinish,  // the program's end
    kUnlock,  // the motors let go
  };
  Kind kind = Kind::kMove;
  std::int64_t dx = 0, dy = 0;
  bool compact = false, beam = false;
  SpeedWord speed{};
};

class GlInterpreter {
 public:
  void feed(std::string_view text);
  std::vector<GlAction> take_actions();

  bool beam() const { return beam_; }
  bool compact() const { return compact_; }
  bool finished() const { return finished_; }
  // What it did not understand, or what no board is known to take well. Empty for clean code.
  const std::vector<std::string>& complaints() const { return complaints_; }

 private:
  enum class Digits { kDistance, kSpeed, kRasterStep, kMode };

  void take(char c);
  void digit(char c);
  void command(char c);
  void direction(char c);
  void end_of_state();
  void pause_or_home();
  void engage(bool x, bool y);
  void add(std::int64_t mils);
  void execute();
  void read_speed();
  void reset();
  void complain(std::string what);

  std::vector<GlAction> actions_;
  std::vector<std::string> complaints_;
  std::int64_t pending_x_ = 0, pending_y_ = 0;
  bool left_ = false, up_ = false, x_on_ = false, y_on_ = false;
  bool beam_ = false, compact_ = false, finished_ = false;
  bool bar_ = false;  // the last character was |
  Digits digits_ = Digits::kDistance;
  std::string number_;
  int mode_ = -1;  // of S; -1: none
  bool finishing_ = false, restarting_ = false;
  char last_ = 0;  // command
  SpeedWord speed_;
  bool has_speed_ = false;
};

}  // namespace veneer::sim
