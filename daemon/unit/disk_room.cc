#include "daemon/unit/disk_room.h"

#include <fmt/format.h>

namespace veneer::daemon {

Status check_room(const std::optional<std::uintmax_t>& free_bytes) {
  constexpr std::uintmax_t kOfARun = 10'000'000;  // bytes
  if (!free_bytes || *free_bytes >= kOfARun) return Ok();
  return Error{ErrorCode::kRefused, fmt::format("{}: make room on the disk, then try again", kDiskIsNearlyFull)};
}

}  // namespace veneer::daemon
