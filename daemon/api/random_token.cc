#include "daemon/api/random_token.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/base64.h"

namespace veneer::daemon {

Result<std::string> random_token() {
  std::array<unsigned char, 32> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    return Error{ErrorCode::kInternal, "the system has no random numbers to give: try again"};
  }
  std::string token = base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  token.resize(43);  // without the '=' at its end
  // OpenSSL has no base64 for URLs (RFC 4648, section 5).
  std::ranges::replace(token, '+', '-');
  std::ranges::replace(token, '/', '_');
  return token;
}

bool equal_secrets(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace veneer::daemon
