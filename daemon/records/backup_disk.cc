#include "daemon/records/backup_disk.h"

#include <ctime>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

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

std::optional<std::chrono::system_clock::time_point> newest_in(const std::filesystem::path& folder) noexcept {
  try {
    if (const auto made_at = newest_backup_at(folder)) return utc_time(*made_at);
  } catch (const std::exception&) {
    // There was no memory to read it with: the next look tells.
  }
  return std::nullopt;
}

}  // namespace

struct BackupDisk::Answer {
  std::mutex mutex;
  bool awaited = false;             // guarded by mutex
  std::optional<BackupsSeen> seen;  // guarded by mutex

  void came(const BackupsSeen& now) {
    const std::lock_guard lock(mutex);
    awaited = false, seen = now;
  }
};

BackupDisk::BackupDisk(std::filesystem::path folder, const Clock& clock)
    : folder_(std::move(folder)), clock_(clock), answer_(std::make_shared<Answer>()) {}

void BackupDisk::look() {
  {
    const std::lock_guard lock(answer_->mutex);
    if (std::exchange(answer_->awaited, true)) return;
  }
  asked_at_ = clock_.now();
  try {
    // Nobody can end a thread that its disk holds. It knows nothing but what it shares.
    std::thread([answer = answer_, folder = folder_] { answer->came({newest_in(folder)}); }).detach();
  } catch (const std::exception&) {
    const std::lock_guard lock(answer_->mutex);
    answer_->awaited = false;  // no room for a thread: the next look tells
  }
}

std::optional<BackupsSeen> BackupDisk::seen() const {
  const std::lock_guard lock(answer_->mutex);
  return answer_->seen;
}

std::string BackupDisk::silence() const {
  const std::lock_guard lock(answer_->mutex);
  if (!answer_->awaited || clock_.now() - asked_at_ < kSilent) return "";
  return "the disk of the backups does not answer, and no backup is made before it does: see that it is switched on, "
         "plugged in, and its network up";
}

}  // namespace veneer::daemon
