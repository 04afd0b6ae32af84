#include "daemon/services/store_health.h"

#include <ctime>
#include <system_error>

#include "daemon/store/backup.h"

namespace veneer::daemon {
namespace {

// "2026-05-01T07:30:00.000Z", as manifests have it.
std::optional<std::chrono::system_clock::time_point> utc_time(const std::string& text) {
  std::tm at{};
  const char* end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &at);
  if (end == nullptr) return std::nullopt;
  return std::chrono::system_clock::from_time_t(::timegm(&at));
}

}  // namespace

StoreHealth store_health(const std::filesystem::path& data_dir, const std::filesystem::path& backup_dir) {
  StoreHealth out;
  std::error_code failed;
  if (const auto room = std::filesystem::space(data_dir, failed); !failed) out.free_bytes = room.available;
  if (const auto made_at = newest_backup_at(backup_dir)) out.backup_at = utc_time(*made_at);
  return out;
}

}  // namespace veneer::daemon
