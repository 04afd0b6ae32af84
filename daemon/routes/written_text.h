// What people write in requests: reasons, notes.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string>

#include "base/utf8.h"
#include "daemon/api/request_reader.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {

// Characters, not bytes.
inline void limit_text(RequestReader& body, const char* what, const std::string& text, std::ptrdiff_t least) {
  const auto length = characters(text);
  if (length < least || length > ranges::kLongestReason)
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("the {} must be {} to {} characters", what, least, ranges::kLongestReason)});
}

}  // namespace veneer::daemon
