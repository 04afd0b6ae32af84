#include "daemon/wiring.h"

#include <fmt/format.h>

#include "drivers/file/file_camera.h"
#include "drivers/file/file_scanner.h"
#include "drivers/grbl/grbl_laser.h"
#include "drivers/sim/client/sim_camera.h"
#include "drivers/sim/client/sim_scanner.h"
#include "drivers/transport/make_transport.h"

namespace veneer::daemon {

Result<Devices> make_devices(const Config& config, const Clock& device_clock, boost::asio::io_context& reactor,
                             const Logger& log) {
  Devices devices;
  if (config.scanner.kind == "sim")
    devices.scanner = std::make_unique<sim::SimScanner>(config.sim.socket.string());
  else
    devices.scanner = std::make_unique<FileScanner>(config.scanner.device);

  if (config.camera.kind == "sim")
    devices.camera = std::make_unique<sim::SimCamera>(config.sim.socket.string());
  else
    devices.camera = std::make_unique<FileCamera>(config.camera.device);

  const bool simulated = config.laser.kind == "sim";
  const std::string port = simulated ? fmt::format("serial:{}", config.sim.laser.string()) : config.laser.port;
  auto link = make_transport(port, reactor);
  if (!link) return link.error();
  devices.laser =
      std::make_unique<grbl::GrblLaser>(std::move(*link), device_clock, reactor, log,
                                        grbl::GrblOptions::for_time_scale(simulated ? config.sim.time_scale : 1));
  return devices;
}

}  // namespace veneer::daemon
