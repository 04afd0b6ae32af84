// Writes strokes as GRBL lines: relative moves in whole micrometres, cut into pieces of bounded duration.
//
// Every absolute place is rounded once, and a move is the difference to where the controller's own sum of moves has got
// to. It adds in single precision, so the sum is followed in single precision: errors do not add up however many the
// moves, and a digit lost on the wire shifts all that follows: it shows when the machine's position is compared at the
// end of the piece. Only the dark way to a piece is absolute (G53). Dark moves carry S0, so that even a G0 that arrives
// as G1 burns nothing. Modes and feed are set ahead of the motions that need them and asked back ($G); no motion goes
// out before the answer is right, since a feed that lost a digit would make a short motion last for a minute. Each
// stroke's first burning line sets the power; modes, feed and power are asked back after it, before each change of the
// mode, and after the last one. Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/arc_fit.h"
#include "drivers/grbl/settings.h"
#include "drivers/laser_job.h"

namespace veneer::grbl {

enum class LineKind {
  kModal,   // sets a mode, moves nothing
  kTravel,  // moves dark
  kBurn,    // moves with the beam on
  kEcho,    // $G: asks what the controller understood
  kDwell,   // answered only when all motion before it has ended
};

struct GcodeLine {
  static constexpr int kAny = -1;
  std::string text;  // with its newline
  LineKind kind = LineKind::kModal;
  WirePoint from, to;      // of a motion
  double longest_s = 0;    // of a motion: from standstill to standstill, so never shorter than the true duration
  std::size_t stroke = 0;  // of a burning motion: index into the job's strokes
  bool ends_stroke = false;
  int feed = 0;       // of an echo: what must come back
  int power = kAny;   // S of a burning line, and of the echo after one
  int motion = 1;     // of such an echo: G1, G2 or G3
  bool gate = false;  // of an echo: no motion is sent before its answer is right

  std::optional<ArcShape> arc = std::nullopt;  // of a motion that is no straight line

  bool moves() const { return kind == LineKind::kTravel || kind == LineKind::kBurn; }
  bool lit() const { return kind == LineKind::kBurn && power != 0; }  // dry runs are not
};

// Curves of fine lines are sent as arcs, within 0.01 mm of them, as far as that is safe (arc_guard.h).
//
// All strokes of one piece, from the machine's place `at`, ending with the beam off and a dwell. `first` is the index
// of the first of them in the job. No motion lasts longer than `longest_move_s`.
std::vector<GcodeLine> write_group(std::span<const Stroke> strokes, std::size_t first, WirePoint at,
                                   const MachineSettings& settings, double longest_move_s);

// A dark way in jog lines ($J=), none lasting longer than `longest_move_s`.
std::vector<GcodeLine> write_jog(WirePoint from, WirePoint to, MmPerSecond speed, const MachineSettings& settings,
                                 double longest_move_s);

// "X12.3Y-0.004": the axes that move, by so many micrometres.
std::string axis_words(WirePoint by);

// Never less than an arc takes from standstill to standstill: the controller plans it as chords, sees no farther than
// its planner holds of them, and takes the corners between them by its junction deviation.
double arc_stop_to_stop_s(double length_mm, double radius_mm, double speed_mm_s, const MachineSettings& settings);

// Time a straight motion takes from standstill to standstill.
double stop_to_stop_s(WirePoint from, WirePoint to, double speed_mm_s, const MachineSettings& settings);

// Checks the job whole, before any byte of it is sent: places, speeds, powers, order. The sentence names the stroke.
Status check_job(const LaserJob& job, const MachineSettings& settings);

}  // namespace veneer::grbl
