// One laser head. Coordinates are MachineFrame: as commanded to the controller, +y away from the operator; the driver
// only maps origin and signs to the wire.
//
// Threading: bound to the reactor; no call blocks. Events arrive on the reactor, in order.
// Safety:    strokes are sent in a mode in which the beam goes out by itself once bytes stop arriving; at most 1.0 s of
//            motion is queued in the controller; the destructor commands the beam off. Nothing moves but after home(),
//            jog() or start(). No call resumes or reconnects by itself.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "drivers/laser_job.h"

namespace veneer {

// How the machine moves, for estimates of time and for run-ups.
struct LaserMotion {
  MmPerSecond fastest_x{0}, fastest_y{0};
  MmPerSecond2 acceleration_x{0}, acceleration_y{0};
  Millimetres junction_deviation{0};
  int planner_blocks = 0;
  friend bool operator==(const LaserMotion&, const LaserMotion&) = default;
};

// How the head goes between strokes, with the beam off.
enum class DarkWays {
  kStraight,  // straight to the next stroke; the passes of an open one go back and forth
  kWithinBox  // anywhere within the box of both ends; every pass begins at the stroke's front, run-ups are left out
};

struct LaserLimits {
  Box<MachineFrame> travel;  // where strokes may lie
  std::string firmware;      // as the controller names itself: "Grbl 1.1h"
  // Does it find its corner itself, the same one each time? If not, the first home() takes the place where the head
  // stands as the lower left corner, and nothing that was measured before holds. Later ones bring the head back to it.
  bool finds_home = true;
  MmPerSecond fastest{0};                            // of the slower axis; 0 = not known
  std::optional<LaserMotion> motion = std::nullopt;  // as the controller tells it; nothing when it does not
  // Settings of the controller that are possible but unlikely ("$30 = 5 (full power)"): the operator confirms each by
  // name before the beam comes on, as what the configuration lists.
  std::vector<std::string> to_confirm{};
  // What tells this machine from another at the same port, as its controller says: firmware and the settings that
  // decide where a place lies and how strong the beam is. "" when it does not say. What was measured on one is void on
  // another.
  std::string identity{};
  bool burns = true;  // false: a file that stands for a machine, so that nothing is cut whatever it says
  DarkWays dark_ways = DarkWays::kStraight;
};

// What the operator turns while a job runs: per cent of the programmed value.
struct LaserOverrides {
  int feed = 100, rapid = 100, power = 100;
  friend bool operator==(const LaserOverrides&, const LaserOverrides&) = default;
};

namespace laser_event {
struct Connected {
  LaserLimits limits;
};
// A connect, home or start that did not begin, or ended before anything was burnt.
struct Failed {
  Error error;
};
struct Homed {};
struct Held {};     // motion stopped, beam verified off
struct Resumed {};  // motion goes on
// The machine has burnt this stroke: index into LaserJob::strokes. Follows executed motion, not acknowledgements.
struct StrokeExecuted {
  std::size_t stroke;
};
// All strokes of the piece are burnt, the machine has drained, and its own position agrees with the expected one.
struct PieceVerified {
  PieceId piece;
};
// Everything burnt and verified, beam off. `stopped_early` after stop_after_piece().
struct Done {
  bool stopped_early = false;
  std::string remark{};  // what the operator should look at; "" when nothing
};
// The job is over, the beam was commanded off. Pieces begun but not verified are suspect; the rest was never touched.
// After a reset in motion, a lost link or an alarm the position is unknown: home() before anything else.
struct Aborted {
  Error error;
  std::vector<PieceId> suspect;
  bool position_lost = true;
  // Where the head was once it may have left its path: places it reported, from the last one that was proven. The beam
  // may have been on anywhere within `stray_reach` of this line. Empty when nothing says that it strayed.
  Polyline<MachineFrame> stray_path{};
  Millimetres stray_reach{0};
};
// The controller has read every line of the job and would take it. Nothing moved.
struct Checked {};
// The head stands still after a jog; `error` when it did not get where it was sent.
struct JogEnded {
  std::optional<Error> error;
};
// While no job ran the machine dropped out by itself: link lost, alarm, a reset nobody asked for. Nothing moves;
// connect() when `connected` is false, then home(), before anything else.
struct Fault {
  Error error;
  bool connected = false;
};
}  // namespace laser_event

using LaserEvent =
    std::variant<laser_event::Connected, laser_event::Failed, laser_event::Homed, laser_event::Held,
                 laser_event::Resumed, laser_event::StrokeExecuted, laser_event::PieceVerified, laser_event::Done,
                 laser_event::Aborted, laser_event::Checked, laser_event::JogEnded, laser_event::Fault>;

// What the machine says of itself, last heard.
struct LaserStatus {
  bool connected = false;
  std::string state;  // the controller's own word: "Idle", "Run", "Hold:0", "Alarm"; "" when not connected
  Point<MachineFrame> position{};
  bool beam_on = false;  // the controller reports power while moving; no proof of the tube itself
  bool homed = false;
  std::string firmware;
  LaserOverrides overrides;         // as the machine told last
  LaserOverrides overrides_wanted;  // as asked for last; the machine gets there step by step
  // Nothing while the machine has told of no lid switch; some tell of one only when the lid is opened.
  std::optional<bool> lid_open;
  std::string why_not_connected;  // "" when connected, or when nobody has asked for it yet
  // How often the lid was opened, as far as the machine told, since this driver was made. An opening between two
  // reports counts when the controller latches it, as GRBL does; a machine without a lid switch never counts.
  int lid_openings = 0;
  std::string refusal{};  // why no job may begin now, one sentence that names the remedy; "" when one may
};

class LaserDriver {
 public:
  using OnEvent = std::function<void(const LaserEvent&)>;
  virtual ~LaserDriver() = default;

  // -> Connected or Failed within 5 s.
  virtual void connect(OnEvent on_event) = 0;
  // -> Homed or Failed. Moves (but see LaserLimits::finds_home): an operator's command must stand behind it.
  virtual void home() = 0;
  // Rejects the whole job before moving if any point lies outside the limits (-> Failed).
  // -> StrokeExecuted..., PieceVerified..., then Done or Aborted.
  virtual void start(LaserJob job) = 0;
  // -> Held, or Aborted. Never lost: a job whose last stroke ends meanwhile is Held all the same, and Done follows only
  // behind resume(); one that has just ended is Held at once. A second one while the first is on says nothing more.
  virtual void hold() = 0;
  // Behind Held. -> Resumed, or Held again when the machine will not move: the lid is still open.
  virtual void resume() = 0;
  virtual void stop_after_piece() = 0;  // the piece being burnt is finished and verified -> Done{stopped_early}
  // The reset byte goes out first, everything else after. -> Aborted if a job ran, posted before the call returns.
  virtual void abort() noexcept = 0;
  virtual LaserStatus status() const = 0;

  // What not every family can do; kRefused then. daemon/guarded_laser.h passes each of them on.
  //
  // Lets the controller read the whole job without moving or burning. -> Checked or Failed.
  virtual Status check(const LaserJob& job);
  // Moves the head dark while no job runs. A homed head stays inside the limits. -> JogEnded, unless refused at once.
  virtual Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed);
  virtual void stop_jog();
  // Of a machine that does not find its corner itself, at rest: the head stands at the lower left corner now. home()
  // asks for it when a controller has forgotten where its head stands.
  virtual Status corner_is_here();
  // Feed 25 to 200, rapid 25, 50 or 100, power 10 to 200 per cent. Taken step by step while the machine runs; slowing
  // down waits until no more than 1.0 s of slower motion is queued. They hold from job to job until they are set anew,
  // and a job begins when they are reached. Back to 100 after every reset.
  virtual Status set_overrides(const LaserOverrides& overrides);
};

inline Status LaserDriver::check(const LaserJob&) {
  return Error{ErrorCode::kRefused,
               "this laser's controller cannot read a job without burning it: run it dry instead (--dry)"};
}
inline Status LaserDriver::jog(Millimetres, Millimetres, MmPerSecond) {
  return Error{ErrorCode::kRefused, "this laser cannot be jogged: move its head by its own controls"};
}
inline void LaserDriver::stop_jog() {}
inline Status LaserDriver::corner_is_here() {
  return Error{ErrorCode::kRefused, "this laser finds its corner itself: Reset homes it"};
}
inline Status LaserDriver::set_overrides(const LaserOverrides&) {
  return Error{ErrorCode::kRefused, "this laser has no overrides: change power and speed where they are set"};
}

}  // namespace veneer
