// What a client of TLS says first. It is read before OpenSSL sees it, so that a handshake has its turn (tls_gate.h)
// only when the costly part can follow at once: whoever sends half of it waits for nobody's turn but its own.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace veneer::daemon {

class TlsHello {
 public:
  // How many bytes are still to be read into it, 0 when it is whole; nullopt when this is no ClientHello in one record,
  // as every client sends it.
  std::optional<std::size_t> missing() const;

  std::string bytes;

 private:
  static constexpr std::size_t kHeader = 5, kMostBody = 16 * 1024;
};

}  // namespace veneer::daemon
