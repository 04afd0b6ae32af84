#include "db/clean_mark.h"

#include <fmt/format.h>

#include <fstream>
#include <span>
#include <string>
#include <system_error>

#include "base/files.h"
#include "base/hash.h"

namespace veneer::db {
namespace {

std::filesystem::path mark_of(const std::filesystem::path& file) { return file.string() + ".clean"; }

bool has_log(const std::filesystem::path& file) {
  std::error_code none;
  const auto size = std::filesystem::file_size(file.string() + "-wal", none);
  return !none && size > 0;
}

}  // namespace

Result<bool> is_as_it_was_left(const std::filesystem::path& file) {
  std::string wanted;
  if (!(std::ifstream(mark_of(file)) >> wanted)) return false;
  const auto found = sha256_hex_of_file(file);
  if (!found.ok() || *found != wanted) return false;
  if (has_log(file))
    return Error{ErrorCode::kStorage,
                 fmt::format("beside the database {0} lies a log that is not its own, {0}-wal: end whatever else has "
                             "the database open, move the log away, then start veneerd",
                             file.string())};
  return true;
}

Status remove_clean_mark(const std::filesystem::path& file) { return remove_durably(mark_of(file)); }

void write_clean_mark(const std::filesystem::path& file) {
  if (has_log(file)) return;
  const auto hash = sha256_hex_of_file(file);
  if (!hash.ok()) return;
  const std::string line = *hash + "\n";
  (void)write_whole(mark_of(file), std::as_bytes(std::span(line)));
}

}  // namespace veneer::db
