// Secrets nobody can guess. The daemon's only user of OpenSSL.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

// 256 random bits in URL-safe base64 (43 characters).
Result<std::string> random_token();
// In time that does not depend on where the two differ.
bool equal_secrets(std::string_view a, std::string_view b);

}  // namespace veneer::daemon
