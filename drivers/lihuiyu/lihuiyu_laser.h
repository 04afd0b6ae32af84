// A laser behind a Lihuiyu M2-Nano or M3-Nano board (the K40's): LihuiyuCore, a link, a clock and a timer.
//
// Contract, threading and safety: drivers/laser_driver.h. The protocol itself is in lihuiyu_core.h. What this board
// cannot do: it reports neither position nor beam, so "held" and "beam off" are what it was sent; and should it hang,
// it keeps its beam as it is. Only a relay on the laser's enable line ends that (docs/SAFETY.md).
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/laser_driver.h"
#include "drivers/lihuiyu/lihuiyu_core.h"
#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

class LihuiyuLaser final : public LaserDriver {
 public:
  // `clock` is device time. It, `io` and the logger's sinks must outlive the laser.
  LihuiyuLaser(std::unique_ptr<UsbTransport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
               LihuiyuOptions options = {});
  ~LihuiyuLaser() override;
  LihuiyuLaser(const LihuiyuLaser&) = delete;
  LihuiyuLaser& operator=(const LihuiyuLaser&) = delete;

  void connect(OnEvent on_event) override;
  void home() override;
  void start(LaserJob job) override;
  void hold() override;
  void resume() override;
  void stop_after_piece() override;
  void abort() noexcept override;
  LaserStatus status() const override;

 private:
  void pump();
  void flush_output();
  void arm_timer();
  void deliver_later();

  std::unique_ptr<UsbTransport> transport_;
  const Clock& clock_;
  boost::asio::io_context& io_;
  Logger log_;
  LihuiyuCore core_;
  boost::asio::steady_timer timer_;
  OnEvent on_event_;
  std::shared_ptr<int> alive_;  // handlers posted to the reactor hold it weakly
};

}  // namespace veneer::lihuiyu
