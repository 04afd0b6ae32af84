// What a person can do to the simulated laser by hand: lid, mains, plug. And what can be made to go wrong with it.
//
// Threading: called on the reactor.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "base/result.h"
#include "drivers/sim/grbl_controller/faults.h"

namespace veneer::sim {

class LaserBench {
 public:
  virtual ~LaserBench() = default;
  virtual void set_lid(bool open) = 0;
  virtual void set_power(bool on) = 0;
  virtual void unplug() = 0;  // the port disappears; the controller itself goes on
  virtual Status replug() = 0;
  virtual void inject(const Fault& fault) = 0;
  virtual void set_consent(bool given) = 0;  // for the watchdog: may anything move now?
  virtual nlohmann::json describe()
      const = 0;  // {"port", "state", "lid", "power", "plugged", "beam", "watchdog": {...}}
};

}  // namespace veneer::sim
