// From a configuration to devices: the only place that names concrete drivers.
#pragma once

#include <boost/asio/io_context.hpp>

#include "base/clock.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/cell.h"
#include "daemon/config.h"
#include "guardian/guarded_machine.h"

namespace veneer::daemon {

// Nothing is opened or moved yet. `device_clock` and `reactor` outlive the devices.
Result<Devices> make_devices(const Config& config, const Clock& device_clock, boost::asio::io_context& reactor,
                             const Logger& log);

// Whether a laser could be made of this; nothing is opened.
Status laser_can_be_made(const LaserConfig& laser);

// What has to be darkened should the daemon die.
guardian::GuardedMachine guarded_machine(const Config& config);

}  // namespace veneer::daemon
