// Times and limits of the GRBL driver. All durations are device time.
#pragma once

#include <chrono>
#include <optional>

#include "base/clock.h"
#include "base/units.h"

namespace veneer::grbl {

struct GrblOptions {
  // Status polling: while a job runs, while something is awaited (hold, drain), and at rest.
  Duration poll_period = std::chrono::milliseconds(200);
  Duration fast_poll_period = std::chrono::milliseconds(100);
  Duration rest_poll_period = std::chrono::milliseconds(500);

  // How long the link and the controller may take. Real time underlies these.
  Duration connect_timeout = std::chrono::milliseconds(4500);
  Duration banner_wait = std::chrono::milliseconds(1500);  // a TCP controller that is already running prints none
  Duration settle_time = std::chrono::milliseconds(200);   // after a banner: another may follow, and late answers
  Duration poll_timeout = std::chrono::milliseconds(600);  // a poll without answer until then is lost
  int polls_unanswered = 3;
  Duration silence_timeout = std::chrono::seconds(2);
  Duration lost_reply_timeout = std::chrono::seconds(1);  // machine idle with lines unanswered

  // How long the machine may take.
  Duration hold_timeout = std::chrono::seconds(2);     // to stand still with the beam off
  Duration resume_timeout = std::chrono::seconds(10);  // grblHAL restores accessories for 4 to 5 s
  Duration stop_timeout = std::chrono::seconds(1);     // to stand still before a reset that keeps the position
  Duration homing_timeout = std::chrono::seconds(120);
  Duration stall_timeout = std::chrono::seconds(5);  // running without moving
  // Beyond the longest that motions may take by the controller's own settings.
  Duration late_tolerance = std::chrono::milliseconds(500);

  double queued_motion_s = 1.0;          // never more in the controller
  double longest_move_s = 0.2;           // longer strokes are split
  Millimetres position_tolerance{0.01};  // beyond half a motor step

  // Where the head's Z axis stands (the controller's own machine coordinate) when the focus lies on the wood. Homing
  // ends there, and nothing is burnt elsewhere. Without it the focus is set by hand.
  std::optional<Millimetres> focus_z;

  bool recording = false;  // the port is a file: LaserLimits::burns

  // Device time runs `scale` times as fast as real time, but links, processes and schedulers do not: stretches the
  // limits on them.
  static GrblOptions for_time_scale(double scale);
};

}  // namespace veneer::grbl
