#include "daemon/api/tls_hello.h"

namespace veneer::daemon {

std::optional<std::size_t> TlsHello::missing() const {
  if (bytes.size() < kHeader) return kHeader - bytes.size();
  const auto at = [this](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])); };
  constexpr std::size_t kHandshakeRecord = 22, kClientHello = 1, kMessageHeader = 4;
  const std::size_t body = at(3) << 8 | at(4);
  if (at(0) != kHandshakeRecord || at(1) != 3 || body < kMessageHeader || body > kMostBody) return std::nullopt;
  if (bytes.size() < kHeader + body) return kHeader + body - bytes.size();
  const std::size_t message = at(kHeader + 1) << 16 | at(kHeader + 2) << 8 | at(kHeader + 3);
  if (at(kHeader) != kClientHello || message + kMessageHeader > body) return std::nullopt;
  return 0;
}

}  // namespace veneer::daemon
