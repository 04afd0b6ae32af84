// Switches a machine's beam off without moving it: a reset on the machine's own port, and nothing else.
#pragma once

#include <chrono>

#include "base/result.h"
#include "guardian/guarded_machine.h"

namespace veneer::guardian {

// One try: opens the port, resets, and waits until the machine shows that it has taken it: GRBL by its banner, a
// Lihuiyu board by its status. Blocks for `patience` at most, and the time a port takes to close. kUnavailable when the
// port cannot be opened, kTimeout when nothing answers (the reset was sent all the same). A "file:" is no machine.
Status darken(const GuardedMachine& machine, std::chrono::milliseconds patience = std::chrono::seconds(3));

}  // namespace veneer::guardian
