// What a person can do to the simulated laser by hand: lid, mains, plug. And what can be made to go wrong with it.
//
// Threading: called on the reactor.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "drivers/sim/signal_at_burn.h"

namespace veneer::sim {

// What a fault is and when it happens differs from machine to machine: grbl_controller/faults.h,
// lihuiyu_board/faults.h.
struct FaultRequest {
  std::string name;
  std::optional<double> value, after;  // after: 1 or more
};

class LaserBench {
 public:
  virtual ~LaserBench() = default;
  virtual void set_lid(bool open) = 0;
  virtual void set_power(bool on) = 0;
  virtual void unplug() = 0;  // the port disappears; the controller itself goes on
  virtual Status replug() = 0;
  // kNotFound names the faults this machine can have.
  virtual Status inject(const FaultRequest& request) = 0;
  virtual void set_consent(bool given) = 0;  // for the watchdog: may anything move now?
  virtual void signal_at_burn(const SignalAtBurn::Order& order) = 0;
  virtual nlohmann::json describe()
      const = 0;  // {"port", "state", "lid", "power", "plugged", "beam", "watchdog": {...}}
};

}  // namespace veneer::sim
