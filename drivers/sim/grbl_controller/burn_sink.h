// What leaves the simulated controller besides bytes: where its beam really was, and when.
#pragma once

#include "base/clock.h"

namespace veneer::sim {

// Where the head is, in commanded millimetres counted from the limit switches at the upper right: after homing
// -travel <= x, y <= 0. This is the steppers' truth; the position the controller reports differs from it until it has
// homed and after steps were lost.
struct HeadPosition {
  double x_mm = 0;
  double y_mm = 0;
};

// The beam burnt along a straight line. A beam at rest gives a segment without length.
struct BurnSegment {
  HeadPosition from;
  HeadPosition to;
  double power_seconds = 0;  // power fraction (0 = off, 1 = rated) integrated over time; > 0
  TimePoint start;
  TimePoint end;

  double length_mm() const;
  // Power fraction times seconds per millimetre; 0 for a beam at rest.
  double energy_per_mm() const;
};

// Gets every burn and every dark motion in the order of time, as soon as the controller is advanced over it.
class BurnSink {
 public:
  virtual ~BurnSink() = default;
  virtual void burn(const BurnSegment& segment) = 0;
  // The motors went straight from one place to another without burning.
  virtual void moved(const HeadPosition& /*from*/, const HeadPosition& /*to*/) {}
  // The machine has found its switches.
  virtual void homed() {}
};

// The controller's own beam watchdog, kept beside whatever the sink does. All times are device time.
struct BeamLog {
  double beam_on_s = 0;
  double beam_at_rest_s = 0;  // beam on while nothing moved
  double burnt_mm = 0;
  double burnt_unhomed_mm = 0;          // beam on while the position was not to be trusted
  double moved_without_consent_mm = 0;  // see GrblController::set_consent
  double burnt_without_consent_mm = 0;
  double beam_while_lid_open_s = 0;  // power commanded while the interlock held the tube dark
  // The longest time between the arrival of a line and the end of its motion, without time spent in holds: what the
  // machine would still have burnt had the link died at that moment.
  double longest_queued_motion_s = 0;
  std::size_t lost_bytes = 0;  // overran the receive buffer
};

}  // namespace veneer::sim
