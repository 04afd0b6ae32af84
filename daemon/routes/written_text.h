// What people write in requests: reasons, notes.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>

#include "daemon/api/request_reader.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {

// Characters, not bytes; in UTF-8 a character's further bytes begin with 10.
inline void limit_text(RequestReader& body, const char* what, const std::string& text, std::ptrdiff_t least) {
  const auto length = std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });
  if (length < least || length > ranges::kLongestReason)
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("the {} must be {} to {} characters", what, least, ranges::kLongestReason)});
}

}  // namespace veneer::daemon
