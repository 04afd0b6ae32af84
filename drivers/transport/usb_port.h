// Interface 0 of one USB device, over libusb. Kernel drivers that hold it are detached, the interface is claimed.
//
// Transfers are libusb's asynchronous ones: submitted from the reactor, reaped by a thread of the port's own, which
// only posts what came back. They are made when the port is opened, so that an urgent one finds its transfer and its
// memory ready and shares no lock with that thread but libusb's own. Nothing here waits for the bus, but for what the
// kernel takes to call a transfer back (submit_urgent(), after its own is on its way); open() and the destructor wait
// for the last transfers of a port just closed, a quarter of a second at most.
#pragma once

#include <boost/asio/io_context.hpp>
#include <deque>
#include <memory>
#include <string>

#include "drivers/usb_transport.h"

namespace veneer {

struct UsbAddress {
  std::uint16_t vendor = 0, product = 0;
  std::string place;  // "1-2.4": bus and ports, as the kernel names it; "": the only such device
};

class UsbPort final : public UsbTransport {
 public:
  UsbPort(boost::asio::io_context& io, UsbAddress address);
  ~UsbPort() override;
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  Status open(OnReply on_reply, OnClosed on_closed) override;
  void submit(UsbRequest request) override;
  void submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept override;
  void close() noexcept override;

 private:
  class Session;
  void next();
  void fail(Error error);
  Error gone(const std::string& why) const;

  boost::asio::io_context& io_;
  UsbAddress address_;
  std::unique_ptr<Session> session_, closing_;
  std::deque<UsbRequest> waiting_;
  bool under_way_ = false;  // a transfer of these: until it has come back, whether or not anybody still wants it
  OnReply on_reply_;
  OnClosed on_closed_;
  std::shared_ptr<int> opened_;      // renewed by close(): what comes back later belongs to a former session
  std::shared_ptr<int> generation_;  // renewed by close() and submit_urgent(): what was submitted before is unwanted
};

}  // namespace veneer
