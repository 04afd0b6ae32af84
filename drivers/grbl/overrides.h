// Turns feed, rapid and power overrides by real-time bytes, one step at a time.
//
// GRBL keeps one flag for each of these bytes, so two of a kind that arrive together count once. A step is therefore
// sent only when the one before was seen in a report. Pure; not thread-safe.
#pragma once

#include <array>
#include <string>

#include "base/result.h"
#include "drivers/laser_driver.h"

namespace veneer::grbl {

class Overrides {
 public:
  // kInvalidArgument outside what LaserDriver::set_overrides() allows.
  Status want(const LaserOverrides& overrides);
  const LaserOverrides& known() const { return known_; }
  const LaserOverrides& wanted() const { return wanted_; }
  bool settled() const { return known_ == wanted_; }
  // The bytes of the next step; empty while one is under way or none is needed.
  std::string next_step();
  // What a report asked for after the last step says. False when somebody else has turned them; they are then turned
  // back by the next steps.
  bool reported(const std::array<int, 3>& feed_rapid_power);
  // The slowest that motion may run now or after the next step, as a fraction of its programmed speed.
  double slowest() const;
  double slowest_wanted() const;

 private:
  LaserOverrides known_, awaited_, wanted_;
  bool stepping_ = false;
};

}  // namespace veneer::grbl
