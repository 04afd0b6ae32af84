// What the unit says of itself, for whoever asks and commands nothing.
//
// Threading: bound to the reactor. References are good until the reactor's next turn.
#pragma once

#include "base/result.h"
#include "daemon/unit/cell_view.h"
#include "daemon/unit/consent.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class UnitState {
 public:
  virtual ~UnitState() = default;
  virtual const CellView& view() const = 0;
  virtual bool is_connected() const = 0;
  // Of the laser, since it was connected last; empty travel before.
  virtual const LaserLimits& limits() const = 0;
  // What an operator's word stands on now, and whether it still does (consent.h).
  virtual Consent consent() const = 0;
  virtual Status still_holds(const Consent& given) const = 0;
  // May the program end for somebody's convenience (at_rest.h)?
  virtual Status at_rest() const = 0;
};

}  // namespace veneer::daemon
