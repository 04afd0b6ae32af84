// Whether the data's disk has room for what a run books. Pure; thread-safe.
#pragma once

#include <cstdint>
#include <optional>

#include "base/result.h"

namespace veneer::daemon {

// How it is where there is none, as the chain of interlocks says it, too.
inline constexpr const char* kDiskIsNearlyFull = "the disk is nearly full, and soon no cut can be booked";

// kRefused where less is free than the database takes at once for a run. A disk that has not said refuses nothing: what
// cannot be booked ends its job all the same.
Status check_room(const std::optional<std::uintmax_t>& free_bytes);

}  // namespace veneer::daemon
