// The cell's end of the twin's Lihuiyu board: USB transfers as lines of words over a Unix socket:
//
//   setup ID TIMEOUT_NS TYPE REQUEST VALUE INDEX      write ID TIMEOUT_NS ENDPOINT HEX
//   read ID TIMEOUT_NS ENDPOINT MOST_BYTES            urgent ENDPOINT HEX     all that waits is given up first
//   -> done ID HEX | late ID | error ID               ("-" for no bytes; times are device time)
//
// Contract and threading: drivers/usb_transport.h.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/usb_transport.h"

namespace veneer::sim {

class SimUsb final : public UsbTransport {
 public:
  SimUsb(boost::asio::io_context& io, std::string path);
  ~SimUsb() override;
  SimUsb(const SimUsb&) = delete;
  SimUsb& operator=(const SimUsb&) = delete;

  Status open(OnReply on_reply, OnClosed on_closed) override;
  void submit(UsbRequest request) override;
  void submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept override;
  void close() noexcept override;

 private:
  void receive();
  void take(const std::string& line);
  void send(const std::string& line) noexcept;
  void fail(const std::string& why);

  std::string path_;
  boost::asio::local::stream_protocol::socket socket_;
  std::string incoming_;
  OnReply on_reply_;
  OnClosed on_closed_;
  std::uint64_t next_id_ = 1, first_reply_ = 1;
  std::shared_ptr<int> generation_;  // renewed by close(), so that late handlers know they are late
};

}  // namespace veneer::sim
