// A folder for the files of one piece of work, gone when the work is over. Whatever a kill leaves behind is removed at
// the next start.
//
// Any thread but the reactor. A value; moves only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace veneer::daemon {

class WorkFolder {
 public:
  // A new folder in `data_dir`/work. kStorage.
  static Result<WorkFolder> make(const std::filesystem::path& data_dir);
  WorkFolder(WorkFolder&& o) noexcept : path_(std::exchange(o.path_, {})) {}
  WorkFolder& operator=(WorkFolder&& o) noexcept;
  ~WorkFolder();

  const std::filesystem::path& path() const { return path_; }
  // What the work has made under this name. Nothing when it is larger, or no plain file: work may have left anything
  // there, a link to another file too.
  std::optional<std::string> made(const std::string& name, std::uintmax_t most_bytes) const;

 private:
  explicit WorkFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

// What work is to look at, for a moment: it is not synced to the disk that the ledger needs. kStorage.
Status keep_for_a_moment(std::string_view bytes, const std::string& file);

// At start-up, before any work: what an earlier life of the daemon has left.
void remove_left_work(const std::filesystem::path& data_dir);

}  // namespace veneer::daemon
