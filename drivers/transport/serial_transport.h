// A serial line or pseudo-terminal: raw, 8N1, opened by one program at a time; at a pseudo-terminal, by one of ours.
//
// Closing does not drop DTR (HUPCL is cleared), so it does not reset the board; opening may, once.
#pragma once

#include "drivers/transport/stream_transport.h"

namespace veneer {

class SerialTransport final : public StreamTransport {
 public:
  // What may stand at the path. A simulated controller is at a pseudo-terminal; nothing else is opened for it then, a
  // real one's line least of all.
  enum class At { kAnyLine, kPseudoTerminal };
  SerialTransport(boost::asio::io_context& io, std::string path, unsigned baud, At at = At::kAnyLine);
  static bool supports_baud(unsigned baud);

  Status open(OnBytes on_bytes, OnClosed on_closed) override;

 private:
  void drop_unsent(int descriptor) noexcept override;
  std::string path_;
  unsigned baud_;
  At at_;
};

}  // namespace veneer
