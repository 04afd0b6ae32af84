// A serial line or pseudo-terminal: raw, 8N1, opened by one program at a time.
//
// Closing does not drop DTR (HUPCL is cleared), so it does not reset the board; opening may, once.
#pragma once

#include "drivers/transport/stream_transport.h"

namespace veneer {

class SerialTransport final : public StreamTransport {
 public:
  SerialTransport(boost::asio::io_context& io, std::string path, unsigned baud);
  static bool supports_baud(unsigned baud);

  Status open(OnBytes on_bytes, OnClosed on_closed) override;

 private:
  void drop_unsent(int descriptor) noexcept override;
  std::string path_;
  unsigned baud_;
};

}  // namespace veneer
