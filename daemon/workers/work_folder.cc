#include "daemon/workers/work_folder.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <fstream>
#include <system_error>

#include "base/files.h"

namespace veneer::daemon {
namespace {

std::filesystem::path work_dir(const std::filesystem::path& data_dir) { return data_dir / "work"; }

void remove_whole(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!path.empty()) std::filesystem::remove_all(path, ignored);
}

}  // namespace

Result<WorkFolder> WorkFolder::make(const std::filesystem::path& data_dir) {
  std::error_code failed;
  std::filesystem::create_directories(work_dir(data_dir), failed);
  // mkdtemp() wants six of these at the end, and puts a name that nobody has in their place.
  std::string name = (std::filesystem::absolute(work_dir(data_dir), failed) / std::string(6, 'X')).string();
  if (::mkdtemp(name.data()) == nullptr)
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot make a folder in {}: make room on the disk or give the daemon access, then try "
                             "again",
                             work_dir(data_dir).string())};
  return WorkFolder(name);
}

WorkFolder& WorkFolder::operator=(WorkFolder&& o) noexcept {
  if (this != &o) {
    remove_whole(path_);
    path_ = std::exchange(o.path_, {});
  }
  return *this;
}

WorkFolder::~WorkFolder() { remove_whole(path_); }

std::optional<std::string> WorkFolder::made(const std::string& name, std::uintmax_t most_bytes) const {
  const auto file = path_ / name;
  std::error_code unknown;
  if (std::filesystem::symlink_status(file, unknown).type() != std::filesystem::file_type::regular ||
      std::filesystem::file_size(file, unknown) > most_bytes)
    return std::nullopt;
  return read_whole(file);
}

Status keep_for_a_moment(std::string_view bytes, const std::string& file) {
  std::ofstream kept(file, std::ios::binary);
  if (!kept.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush())
    return Error{ErrorCode::kStorage, "what was sent cannot be kept for a moment: make room on the disk"};
  return Ok();
}

void remove_left_work(const std::filesystem::path& data_dir) { remove_whole(work_dir(data_dir)); }

}  // namespace veneer::daemon
