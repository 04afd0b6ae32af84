#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <vector>

namespace veneer {
namespace {

namespace fs = std::filesystem;

Error storage_error(const fs::path& file) {
  return {
      ErrorCode::kStorage,
      fmt::format("cannot write {}: make room on the disk or give the daemon access, then try again", file.string())};
}

fs::path folder_of(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

// A name lives in its folder: until that is synced, a power cut may take the name though the bytes are there.
bool sync_folder(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool synced = ::fsync(fd) == 0;
  return ::close(fd) == 0 && synced;
}

bool make_folders(const fs::path& folder) {
  std::vector<fs::path> missing;
  for (fs::path at = folder; !at.empty() && !fs::exists(at); at = at.parent_path()) missing.push_back(at);
  for (auto at = missing.rbegin(); at != missing.rend(); ++at) {
    if (::mkdir(at->c_str(), 0755) != 0 && errno != EEXIST) return false;
    if (!sync_folder(folder_of(*at))) return false;
  }
  return true;
}

bool write_all(int fd, std::span<const std::byte> bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

Status write_whole(const fs::path& file, std::span<const std::byte> bytes) {
  const fs::path temporary = file.string() + ".new";
  if (!make_folders(folder_of(file))) return storage_error(file);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (fd < 0) return storage_error(file);
  bool good = write_all(fd, bytes) && ::fsync(fd) == 0;
  good = ::close(fd) == 0 && good;
  if (good && ::rename(temporary.c_str(), file.c_str()) == 0 && sync_folder(folder_of(file))) return Ok();
  ::unlink(temporary.c_str());
  return storage_error(file);
}

Status move_whole(const fs::path& made, const fs::path& file) {
  const int fd = ::open(made.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return storage_error(file);
  struct stat about {};
  bool good = ::fstat(fd, &about) == 0 && S_ISREG(about.st_mode) && ::fsync(fd) == 0;
  good = ::close(fd) == 0 && good;
  if (good && make_folders(folder_of(file)) && ::rename(made.c_str(), file.c_str()) == 0 &&
      sync_folder(folder_of(file)))
    return Ok();
  return storage_error(file);
}

Status remove_durably(const fs::path& file) {
  if (::unlink(file.c_str()) != 0) return errno == ENOENT ? Ok() : Status(storage_error(file));
  if (!sync_folder(folder_of(file))) return storage_error(file);
  return Ok();
}

}  // namespace veneer
