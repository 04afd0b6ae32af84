#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <vector>

namespace veneer {
namespace {

namespace fs = std::filesystem;

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

Error cannot_read(const fs::path& file) {
  return {ErrorCode::kNotFound, fmt::format("cannot read {}: check that it is there and may be read", file.string())};
}

// Both ends open: 1 = all of it, 0 = `out` does not take it, -1 = `in` does not give it.
int pour(int in, int out) {
  std::vector<std::byte> part(1 << 20);
  for (;;) {
    const ssize_t n = ::read(in, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -1;
    if (n == 0) return 1;
    if (!write_all(out, std::span(part).first(static_cast<std::size_t>(n)))) return 0;
  }
}

}  // namespace

std::optional<std::string> read_whole(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  // A pipe has no size, and a file may grow meanwhile: the size only says how much room to make at first.
  constexpr std::size_t kLeastRoom = 4096;
  struct stat what {};
  const bool sized = ::fstat(fd, &what) == 0 && S_ISREG(what.st_mode) && what.st_size > 0;
  std::string bytes(sized ? static_cast<std::size_t>(what.st_size) + 1 : kLeastRoom, '\0');
  std::size_t filled = 0;
  ssize_t n = 0;
  do {
    if (filled == bytes.size()) bytes.resize(2 * bytes.size());
    n = ::read(fd, bytes.data() + filled, bytes.size() - filled);
    if (n > 0) filled += static_cast<std::size_t>(n);
  } while (n > 0 || (n < 0 && errno == EINTR));
  ::close(fd);
  if (n < 0) return std::nullopt;
  bytes.resize(filled);
  return bytes;
}

std::optional<Error> disk_refuses(const fs::path& file) {
  constexpr std::uint64_t kNothingLeft = 64 << 10;  // what an allocation unit or a journal may still leave free
  fs::path at = file;
  struct statvfs disk {};
  while (::statvfs(at.empty() ? "." : at.c_str(), &disk) != 0) {
    if ((errno != ENOENT && errno != ENOTDIR) || at.empty() || at == at.root_path()) return std::nullopt;
    at = at.parent_path();
  }
  if ((disk.f_flag & ST_RDONLY) != 0)
    return Error{
        ErrorCode::kStorage,
        fmt::format("cannot write {}, because its disk is mounted read-only: mount it for writing, and look at "
                    "the disk first if nobody mounted it so",
                    file.string())};
  if (disk.f_bavail * disk.f_frsize < kNothingLeft || (disk.f_files > 0 && disk.f_favail == 0))
    return Error{
        ErrorCode::kStorage,
        fmt::format("cannot write {}, because its disk is full: make room on the disk, then try again", file.string())};
  return std::nullopt;
}

Error cannot_write(const fs::path& file) {
  if (auto refused = disk_refuses(file)) return *std::move(refused);
  return {
      ErrorCode::kStorage,
      fmt::format("cannot write {}: make room on the disk or give the daemon access, then try again", file.string())};
}

Status write_whole(const fs::path& file, std::span<const std::byte> bytes) {
  const fs::path temporary = file.string() + ".new";
  if (!make_folders(folder_of(file))) return cannot_write(file);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (fd < 0) return cannot_write(file);
  bool good = write_all(fd, bytes) && ::fsync(fd) == 0;
  good = ::close(fd) == 0 && good;
  if (good && ::rename(temporary.c_str(), file.c_str()) == 0 && sync_folder(folder_of(file))) return Ok();
  const Error refused = cannot_write(file);
  ::unlink(temporary.c_str());
  return refused;
}

Status move_whole(const fs::path& made, const fs::path& file) {
  const int fd = ::open(made.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return cannot_write(file);
  struct stat about {};
  bool good = ::fstat(fd, &about) == 0 && S_ISREG(about.st_mode) && ::fsync(fd) == 0;
  good = ::close(fd) == 0 && good;
  if (good && make_folders(folder_of(file)) && ::rename(made.c_str(), file.c_str()) == 0 &&
      sync_folder(folder_of(file)))
    return Ok();
  return cannot_write(file);
}

Status move_folder_whole(const fs::path& made, const fs::path& folder) {
  if (make_folders(folder_of(folder)) && ::rename(made.c_str(), folder.c_str()) == 0 && sync_folder(folder_of(folder)))
    return Ok();
  return cannot_write(folder);
}

Status copy_into(const fs::path& from, const fs::path& to) {
  const int in = ::open(from.c_str(), O_RDONLY | O_CLOEXEC);
  if (in < 0) return cannot_read(from);
  const int out = make_folders(folder_of(to)) ? ::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640) : -1;
  if (out < 0) {
    ::close(in);
    return cannot_write(to);
  }
  const int poured = pour(in, out);
  bool good = poured > 0 && ::fsync(out) == 0;
  good = ::close(out) == 0 && good;
  ::close(in);
  if (good) return Ok();
  const Error refused = poured < 0 ? cannot_read(from) : cannot_write(to);
  ::unlink(to.c_str());
  return refused;
}

Status link_into(const fs::path& from, const fs::path& to) {
  if (!make_folders(folder_of(to))) return cannot_write(to);
  if (::link(from.c_str(), to.c_str()) == 0) return Ok();
  return copy_into(from, to);
}

Status sync_folders(const fs::path& folder) {
  std::error_code failed;
  for (fs::recursive_directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed))
    if (at->is_directory(failed) && !at->is_symlink(failed) && !sync_folder(at->path()))
      return cannot_write(at->path());
  if (failed || !sync_folder(folder)) return cannot_write(folder);
  return Ok();
}

Status remove_durably(const fs::path& file) {
  if (::unlink(file.c_str()) != 0) return errno == ENOENT ? Ok() : Status(cannot_write(file));
  if (!sync_folder(folder_of(file))) return cannot_write(file);
  return Ok();
}

}  // namespace veneer
