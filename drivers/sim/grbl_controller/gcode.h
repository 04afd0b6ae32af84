// GRBL's G-code: one line in, what is to be done or an error number out. Keeps the modal state and the position in
// which the next line will be read (where the queue ends, not where the head is).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/sim/grbl_controller/motion.h"
#include "drivers/sim/grbl_controller/settings.h"

namespace veneer::sim {

enum class SpindleMode { kOff, kConstant, kDynamic };  // M5, M3, M4

namespace gcode {

struct Spindle {  // after all motion queued before
  SpindleMode mode = SpindleMode::kOff;
  double speed = 0;
};
struct Coolant {  // after all motion queued before
  bool flood = false;
};
struct Dwell {  // after all motion queued before
  double seconds = 0;
};
struct Line {
  Vec3 target{};
  double feed = 0;  // mm/s
  bool rapid = false;
  SpindleMode mode = SpindleMode::kOff;
  double speed = 0;  // S that burns during this motion; 0 for dark ones
};
struct Pause {};         // M0
struct ProgramEnd {};    // M2, M30
struct StoreOffsets {};  // EEPROM is written

using Action = std::variant<Spindle, Coolant, Dwell, Line, Pause, ProgramEnd, StoreOffsets>;

struct Modal {
  int motion = 0;  // G0 1 2 3 80
  int plane = 17;
  bool inches = false;
  bool relative = false;
  bool inverse_time = false;
  int system = 0;  // 0 = G54
  SpindleMode spindle = SpindleMode::kOff;
  bool flood = false;
};

}  // namespace gcode

class GcodeInterpreter {
 public:
  explicit GcodeInterpreter(const GrblSettings& settings) : settings_(settings) {}

  // `line` without blanks and comments, in capitals. 0 and the actions in order, or GRBL's error number and nothing
  // changed.
  int execute(std::string_view line, std::vector<gcode::Action>& actions);
  // The part of $J= after the equals sign. The modal state stays as it is.
  int jog(std::string_view line, std::vector<gcode::Action>& actions);

  // As after a reset: G0 G54 G17 G21 G90 G94 M5 M9 F0 S0, no G92; stored offsets stay.
  void reset(const Vec3& position);
  void set_position(const Vec3& position) { position_ = position; }

  // "[GC:...]" and the lines of "$#".
  std::string modal_report() const;
  std::string offsets_report() const;
  // Machine position = work position + this.
  Vec3 work_offset() const;
  const gcode::Modal& modal() const { return modal_; }

 private:
  struct Words;
  static int read_words(std::string_view line, bool jog, Words& words);
  static int read_g(double value, Words& words);
  static int read_m(double value, Words& words);
  int check(Words& words, bool jog) const;
  int check_non_modal(Words& words) const;
  int check_motion(Words& words, const gcode::Modal& next, std::vector<Vec3>& path) const;
  int arc_path(Words& words, const gcode::Modal& next, const Vec3& target, std::vector<Vec3>& path) const;
  Vec3 target_of(const Words& words, const gcode::Modal& next) const;
  gcode::Modal next_modal(const Words& words) const;
  double feed_of(const Words& words, const gcode::Modal& next) const;
  void apply_non_modal(const Words& words, const gcode::Modal& next, std::vector<gcode::Action>& actions);
  void emit(const Words& words, const gcode::Modal& next, const std::vector<Vec3>& path,
            std::vector<gcode::Action>& actions);

  using Offsets = std::array<Vec3, 6>;
  const GrblSettings& settings_;
  gcode::Modal modal_;
  double feed_ = 0;  // mm/min
  double spindle_speed_ = 0;
  Vec3 position_{};    // machine mm
  Offsets systems_{};  // G54..G59
  Vec3 shift_{};       // G92
  Vec3 home_28_{};
  Vec3 home_30_{};
};

}  // namespace veneer::sim
