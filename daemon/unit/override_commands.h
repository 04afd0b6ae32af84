// Feed, rapid and power as an operator turns them while the laser runs.
//
// Threading: bound to the reactor; nothing waits.
#pragma once

#include "base/result.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class OverrideCommands {
 public:
  virtual ~OverrideCommands() = default;

  // What the laser says when it has none (kRefused); kConflict where nothing runs; kRefused beyond the rules
  // (override_rules.h), with the limit.
  virtual Status set(const LaserOverrides& wanted) = 0;
  // As they were asked for last: the machine may still be on its way there.
  virtual LaserOverrides wanted() const = 0;
};

}  // namespace veneer::daemon
