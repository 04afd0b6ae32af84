// A laser behind a GRBL 1.1 controller (also grblHAL and FluidNC): GrblCore, a link, a clock and a timer.
//
// Contract, threading and safety: drivers/laser_driver.h. The protocol itself is in grbl_core.h.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/grbl/grbl_core.h"
#include "drivers/laser_driver.h"
#include "drivers/transport.h"

namespace veneer::grbl {

class GrblLaser final : public LaserDriver {
 public:
  // `clock` is device time. It, `io` and the logger's sinks must outlive the laser.
  GrblLaser(std::unique_ptr<Transport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
            GrblOptions options = {});
  ~GrblLaser() override;
  GrblLaser(const GrblLaser&) = delete;
  GrblLaser& operator=(const GrblLaser&) = delete;

  void connect(OnEvent on_event) override;
  void home() override;
  void start(LaserJob job) override;
  void hold() override;
  void resume() override;
  void stop_after_piece() override;
  void abort() noexcept override;
  LaserStatus status() const override;
  Status check(LaserJob job) override;
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override;
  void stop_jog() override;
  Status set_overrides(const LaserOverrides& overrides) override;

 private:
  void pump();
  void flush_output();
  void arm_timer();
  void deliver_later();

  std::unique_ptr<Transport> transport_;
  const Clock& clock_;
  boost::asio::io_context& io_;
  Logger log_;
  GrblCore core_;
  boost::asio::steady_timer timer_;
  OnEvent on_event_;
  std::shared_ptr<int> alive_;  // handlers posted to the reactor hold it weakly
};

}  // namespace veneer::grbl
