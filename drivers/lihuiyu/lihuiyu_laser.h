// A laser behind a Lihuiyu M2-Nano or M3-Nano board (the K40's): LihuiyuCore and a USB link.
//
// Contract, threading and safety: drivers/laser_driver.h. The protocol itself is in lihuiyu_core.h. What this board
// cannot do: it reports neither position nor beam, so "held" and "beam off" are what it was sent; and should it hang,
// it keeps its beam as it is. Only a relay on the laser's enable line ends that (docs/SAFETY.md).
#pragma once

#include <memory>
#include <string>

#include "drivers/lihuiyu/lihuiyu_core.h"
#include "drivers/reactor_laser.h"
#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

class LihuiyuLaser final : public ReactorLaser<LihuiyuCore> {
 public:
  // `clock` is device time. It, `io` and the logger's sinks must outlive the laser.
  LihuiyuLaser(std::unique_ptr<UsbTransport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
               LihuiyuOptions options = {});
  ~LihuiyuLaser() override;

 private:
  Status open_link() override;
  void send_reset() noexcept override;
  void flush_output() override;

  std::unique_ptr<UsbTransport> transport_;
  const std::string reset_;  // made before it is needed
};

}  // namespace veneer::lihuiyu
