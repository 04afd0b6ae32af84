#include "daemon/unit/disk_room.h"

#include <fmt/format.h>

namespace veneer::daemon {

Status check_room(const std::optional<std::uintmax_t>& free_bytes) {
  constexpr std::uintmax_t kOfARun = 10'000'000;  // bytes
  if (!free_bytes || *free_bytes >= kOfARun) return Ok();
  return Error{ErrorCode::kRefused, fmt::format("{}: make room on the disk, then try again", kDiskIsNearlyFull)};
}

void DiskRoom::told(std::optional<std::uintmax_t> free_bytes) { free_bytes_ = free_bytes, told_ = clock_.now(); }

std::optional<std::uintmax_t> DiskRoom::free_bytes() const {
  return clock_.now() - told_ <= kBelieved ? free_bytes_ : std::nullopt;
}

}  // namespace veneer::daemon
