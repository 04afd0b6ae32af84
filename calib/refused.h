// What a scan or a picture of the bed cannot be taken for. A pure function; thread-safe.
#pragma once

#include <string>
#include <utility>

#include "base/result.h"

namespace veneer::calib {

// kRefused: `sentence` says what was seen, and what whoever laid it there does about it.
inline Error refused(std::string sentence) { return {ErrorCode::kRefused, std::move(sentence)}; }

}  // namespace veneer::calib
