// How much room the cell's data has left, and how old its newest backup is. Asking waits for the disk: never on the
// reactor.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>

namespace veneer::daemon {

struct StoreHealth {
  std::optional<std::uintmax_t> free_bytes;                        // nothing when the disk does not say
  std::optional<std::chrono::system_clock::time_point> backup_at;  // of the newest backup that can be read
};
StoreHealth store_health(const std::filesystem::path& data_dir, const std::filesystem::path& backup_dir);

}  // namespace veneer::daemon
