// The head moved by hand, dark: an operator's words, and what becomes of them (jogging.h).
//
// Refused with a sentence when the state does not allow it. `who` is for the audit log.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <functional>
#include <string>

#include "base/result.h"
#include "base/units.h"

namespace veneer::daemon {

class JogCommands {
 public:
  using Reply = std::function<void(Status)>;
  virtual ~JogCommands() = default;

  // The reply comes when the laser has taken it; the way takes its time.
  virtual void jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who, Reply reply) = 0;
  // At once, whatever state the unit is in.
  virtual void stop() = 0;
  // Where the head stands is the start corner, says the operator (LaserDriver::corner_is_here).
  virtual Status corner_is_here() = 0;
};

}  // namespace veneer::daemon
