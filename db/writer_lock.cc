#include "db/writer_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <system_error>

#include "base/files.h"

namespace veneer::db {

Result<WriterLock> WriterLock::take(const std::filesystem::path& file) {
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  const std::string lock_file = file.string() + ".lock";
  WriterLock lock(::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640));
  if (lock.fd_ < 0)
    if (auto refused = disk_refuses(lock_file)) return *std::move(refused);
  if (lock.fd_ < 0)
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot write {}: check that its folder exists and is ours", lock_file)};
  if (::flock(lock.fd_, LOCK_EX | LOCK_NB) != 0)
    return Error{ErrorCode::kUnavailable,
                 fmt::format("the database {} is in use: another veneerd is running; stop it first", file.string())};
  return lock;
}

bool WriterLock::was_made() const {
  struct stat about {};
  return ::fstat(fd_, &about) == 0 && about.st_size > 0;
}

void WriterLock::note_made() const noexcept {
  constexpr std::string_view kLine = "a database was made here\n";
  if (was_made() || ::write(fd_, kLine.data(), kLine.size()) < 0) return;
  static_cast<void>(::fsync(fd_));
}

void WriterLock::note_gone() const noexcept { static_cast<void>(::ftruncate(fd_, 0) == 0); }

WriterLock::~WriterLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace veneer::db
