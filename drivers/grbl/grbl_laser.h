// A laser behind a GRBL 1.1 controller (also grblHAL and FluidNC): GrblCore and a byte link.
//
// Contract, threading and safety: drivers/laser_driver.h. The protocol itself is in grbl_core.h.
#pragma once

#include <memory>

#include "drivers/grbl/grbl_core.h"
#include "drivers/reactor_laser.h"
#include "drivers/transport.h"

namespace veneer::grbl {

class GrblLaser final : public ReactorLaser<GrblCore> {
 public:
  // `clock` is device time. It, `io` and the logger's sinks must outlive the laser.
  GrblLaser(std::unique_ptr<Transport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
            GrblOptions options = {});
  ~GrblLaser() override;

  Status check(const LaserJob& job) override;
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override;
  void stop_jog() override;
  Status set_overrides(const LaserOverrides& overrides) override;
  Status corner_is_here() override;

 private:
  Status open_link() override;
  void send_reset() noexcept override;
  void flush_output() override;

  std::unique_ptr<Transport> transport_;
};

}  // namespace veneer::grbl
