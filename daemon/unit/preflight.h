// The whole-job check before the first motion, in machine space: every stroke and every dark way between them, against
// the travel, the zones where the head must not go, the recipe's limits, the lid. One sentence for each refusal: it
// names the piece and says what to do. Pure; thread-safe.
//
// The pose, the panel's face and the certificates are proven before strokes exist at all (bed_view.h). The driver
// checks once more what it is sent.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/unit/piece_burn.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Where the head must not go: a clamp, a camera's foot. From the configuration; machine millimetres.
struct KeepOut {
  std::string name;
  Box<MachineFrame> area;
};

// As far as the machine tells; closed again, and waiting for the operator ("Door:0") or coming out of that ("Door:3"),
// is not open.
bool lid_is_open(const LaserStatus& laser);

// Its lid is closed again, and the controller is on its way out of the wait for that: grblHAL takes seconds.
bool is_leaving_door(const LaserStatus& laser);

// kRefused while the lid is open, or was a moment ago: nothing may begin, and hands may be in.
Status check_lid(const LaserStatus& laser);

// As far as the machine tells: no motion is under way or interrupted, and the lid does not park its head.
bool stands_still(const LaserStatus& laser);

// kRefused when the laser cannot move as it is: not there, not homed, lid open, alarm; or must not burn.
Status check_machine(const LaserStatus& laser);

// The same as far as it can be known of a machine that will be connected and homed first.
Status check_before_homing(const LaserStatus& laser);

// kRefused (kInvalidArgument for strokes nobody could burn) with the first thing that is wrong. The head starts from
// `from`.
Status check_strokes(std::span<const PieceBurn> burns, const LaserLimits& limits, std::span<const KeepOut> keep_out,
                     const Point<MachineFrame>& from);

// Does the straight way from `a` to `b` touch the box?
bool crosses(const Box<MachineFrame>& box, const Point<MachineFrame>& a, const Point<MachineFrame>& b);
// The zone that a dark way from `a` to `b` may touch; nullptr: none.
const KeepOut* zone_on_way(std::span<const KeepOut> keep_out, DarkWays ways, const Point<MachineFrame>& a,
                           const Point<MachineFrame>& b);
// kRefused when a zone lies in the way. A head that stands in one, or where several lie one over another, may leave by
// the nearer of the sides that the travel and other zones let it reach, never through the middle. Where it reaches
// none, it may go the shortest way along one axis to where it reaches one, or up to 10 mm farther; the sentence names
// that way.
Status check_jog(std::span<const KeepOut> keep_out, const Box<MachineFrame>& travel, const Point<MachineFrame>& from,
                 Millimetres dx, Millimetres dy);

// The frame that shows where a job will be: the convex hull of all its strokes, closed, one stroke of a job of its own.
// `power` 0 is dark. Empty when there are no strokes.
LaserJob frame_of(std::span<const PieceBurn> burns, MmPerSecond speed, PowerFraction power);

// The convex hull, counter-clockwise, without its first point repeated; fewer than three points when all lie on a line.
std::vector<Point<MachineFrame>> convex_hull(std::vector<Point<MachineFrame>> points);

}  // namespace veneer::daemon
