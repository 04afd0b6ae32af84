// What an operator may turn while the laser runs, so that what was stated before the beam came on stays true. Pure.
#pragma once

#include "base/result.h"
#include "daemon/unit/cell_state.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Overrides belong to what runs: they are set while something does, and are over when it is.
bool overrides_belong_to(CellState state);

// kRefused with the limit. The tube's power is never above the recipe's, nor a frame's above its own: strokes are sent
// so that it follows the speed (M4), and a feed of 150 % means 1.5 times the power. Where wood is `booked`, no more is
// burnt into a millimetre than where the kerf was measured, and not more slowly than the beam is weaker: the feed is
// not below the power.
Status check_overrides(const LaserOverrides& wanted, bool booked);

}  // namespace veneer::daemon
