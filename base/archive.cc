#include "base/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "base/files.h"

namespace veneer {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPart = 1 << 20;
constexpr std::array<std::string_view, 3> kNames = {".tar", ".tar.gz", ".tar.zst"};

struct FreeEntry {
  void operator()(archive_entry* entry) const { archive_entry_free(entry); }
};
using Entry = std::unique_ptr<archive_entry, FreeEntry>;
struct FreeWriter {
  void operator()(archive* a) const { archive_write_free(a); }
};
struct FreeReader {
  void operator()(archive* a) const { archive_read_free(a); }
};

Error cannot_read(const fs::path& file) {
  return {ErrorCode::kNotFound, fmt::format("cannot read {}: check that it is there and that you may", file.string())};
}
Error damaged_archive(const fs::path& file, archive* reader) {
  const char* said = archive_error_string(reader);
  return {ErrorCode::kStorage, fmt::format("the archive {} is damaged ({}): take another one", file.string(),
                                           said != nullptr ? said : "it ends too early")};
}

struct Found {
  fs::path path;
  std::uintmax_t bytes;
};

// In the order of their names, so that the same folder gives the same archive.
Result<std::vector<Found>> files_below(const fs::path& folder) {
  std::vector<Found> found;
  std::error_code failed;
  for (fs::recursive_directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed))
    if (at->symlink_status(failed).type() == fs::file_type::regular)
      found.push_back({at->path(), at->file_size(failed)});
  if (failed) return cannot_read(folder);
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.path < b.path; });
  return found;
}

class Packing {
 public:
  Packing(const fs::path& to, const std::function<void(double)>& progress)
      : to_(to), writer_(archive_write_new()), progress_(progress) {}

  Status open(const std::string& name) {
    // Names beyond the old format's limits, in the same file for every tar there is.
    if (archive_write_set_format_pax_restricted(writer_.get()) != ARCHIVE_OK) return cannot_write(to_);
    const int filter = name.ends_with(".gz")    ? archive_write_add_filter_gzip(writer_.get())
                       : name.ends_with(".zst") ? archive_write_add_filter_zstd(writer_.get())
                                                : archive_write_add_filter_none(writer_.get());
    if (filter != ARCHIVE_OK || archive_write_open_filename(writer_.get(), to_.c_str()) != ARCHIVE_OK)
      return cannot_write(to_);
    return Ok();
  }

  Status add(const Found& file, const std::string& name, std::uintmax_t all) {
    std::ifstream in(file.path, std::ios::binary);
    if (!in) return cannot_read(file.path);
    const Entry entry(archive_entry_new());
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(file.bytes));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    if (archive_write_header(writer_.get(), entry.get()) != ARCHIVE_OK) return cannot_write(to_);
    std::uintmax_t written = 0;
    while (in.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size())) || in.gcount() > 0) {
      const auto part = static_cast<std::size_t>(in.gcount());
      if (archive_write_data(writer_.get(), buffer_.data(), part) != static_cast<la_ssize_t>(part))
        return cannot_write(to_);
      written += part, done_ += part;
      progress_(static_cast<double>(done_) / static_cast<double>(std::max<std::uintmax_t>(all, 1)));
    }
    if (in.bad() || written != file.bytes)
      return Error{ErrorCode::kStorage, fmt::format("cannot read {} to its end: look at its disk", file.path.string())};
    return Ok();
  }

  Status close() { return archive_write_close(writer_.get()) == ARCHIVE_OK ? Ok() : Status(cannot_write(to_)); }

 private:
  const fs::path to_;
  std::unique_ptr<archive, FreeWriter> writer_;
  const std::function<void(double)>& progress_;
  std::vector<char> buffer_ = std::vector<char>(kPart);
  std::uintmax_t done_ = 0;
};

Status sync_file(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  return synced ? Ok() : Status(cannot_write(file));
}

Status pack_into(const fs::path& folder, const std::string& name, const fs::path& part,
                 const std::function<void(double)>& progress) {
  const auto files = files_below(folder);
  if (!files) return files.error();
  std::uintmax_t all = 0;
  for (const Found& file : *files) all += file.bytes;
  Packing packing(part, progress);
  if (Status opened = packing.open(name); !opened) return opened;
  for (const Found& file : *files) {
    const fs::path inside = folder.filename() / file.path.lexically_relative(folder);
    if (Status added = packing.add(file, inside.generic_string(), all); !added) return added;
  }
  if (Status closed = packing.close(); !closed) return closed;
  return sync_file(part);
}

bool stays_below(const fs::path& path) {
  return !path.empty() && path.is_relative() && path == path.lexically_normal() && path.has_filename() &&
         path.begin()->string() != "..";
}

Status write_entry(archive* reader, std::uintmax_t bytes, const fs::path& archive_file, const fs::path& to) {
  std::error_code failed;
  fs::create_directories(to.parent_path(), failed);
  std::ofstream out(to, std::ios::binary | std::ios::trunc);
  std::vector<char> buffer(kPart);
  la_ssize_t got = 0;
  std::uintmax_t written = 0;
  while (out && written <= bytes && (got = archive_read_data(reader, buffer.data(), buffer.size())) > 0) {
    out.write(buffer.data(), got);
    written += static_cast<std::uintmax_t>(got);
  }
  if (got < 0 || written > bytes) return damaged_archive(archive_file, reader);
  out.close();
  return out ? Ok() : Status(cannot_write(to));
}

// Calls `take` with each file of the archive: the reader, its path and its size.
Status each_file(const fs::path& file,
                 const std::function<Status(archive* reader, const fs::path& path, std::uintmax_t bytes)>& take) {
  const std::unique_ptr<archive, FreeReader> reader(archive_read_new());
  archive_read_support_format_tar(reader.get());
  archive_read_support_filter_gzip(reader.get());
  archive_read_support_filter_zstd(reader.get());
  if (!std::ifstream(file, std::ios::binary)) return cannot_read(file);
  if (archive_read_open_filename(reader.get(), file.c_str(), kPart) != ARCHIVE_OK)
    return damaged_archive(file, reader.get());
  while (true) {
    archive_entry* entry = nullptr;
    const int code = archive_read_next_header(reader.get(), &entry);
    if (code == ARCHIVE_EOF) return Ok();
    if (code != ARCHIVE_OK) return damaged_archive(file, reader.get());
    const fs::path path = archive_entry_pathname(entry) != nullptr ? archive_entry_pathname(entry) : "";
    if (archive_entry_filetype(entry) == AE_IFDIR) continue;
    const bool plain = archive_entry_filetype(entry) == AE_IFREG && archive_entry_hardlink(entry) == nullptr;
    if (!plain || !stays_below(path))
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} holds {}, which is no plain file below a folder: take an archive that `veneerctl db "
                               "export` wrote",
                               file.string(), path.string())};
    const la_int64_t bytes = archive_entry_size(entry);
    if (bytes < 0) return damaged_archive(file, reader.get());
    if (Status taken = take(reader.get(), path, static_cast<std::uintmax_t>(bytes)); !taken) return taken;
  }
}

}  // namespace

bool is_archive_name(std::string_view file) {
  return std::ranges::any_of(kNames, [&](std::string_view end) { return file.ends_with(end); });
}

Status pack_folder(const fs::path& folder, const fs::path& file, const std::function<void(double)>& progress) {
  const std::string name = file.filename();
  if (!is_archive_name(name))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} is no name for an archive: let it end in {}", file.string(), fmt::join(kNames, ", "))};
  const fs::path part = file.string() + ".part";
  // Nobody's "folder/." or "folder/": its own name is wanted.
  const fs::path whole = (folder / "").lexically_normal().parent_path();
  Status packed = pack_into(whole, name, part, progress);
  if (packed) packed = move_whole(part, file);
  std::error_code ignored;
  if (!packed) fs::remove(part, ignored);
  return packed;
}

Status unpack_archive(const fs::path& file, const fs::path& folder, std::uint64_t spare_bytes) {
  std::uintmax_t wanted = spare_bytes;
  constexpr std::uintmax_t kMost = std::uintmax_t{1} << 62;  // so that no sum wraps round
  if (Status counted = each_file(file,
                                 [&](archive*, const fs::path&, std::uintmax_t bytes) {
                                   wanted = std::min(kMost, wanted + std::min(kMost, bytes));
                                   return Ok();
                                 });
      !counted)
    return counted;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return cannot_write(folder);
  const auto room = fs::space(folder, failed);
  constexpr std::uintmax_t kMegabyte = 1 << 20;
  if (!failed && room.available < wanted)
    return Error{
        ErrorCode::kStorage,
        fmt::format("to unpack {} needs {} MB free on the disk of {}, and {} MB are: make room there, then try "
                    "again",
                    file.string(), wanted / kMegabyte + 1, folder.string(), room.available / kMegabyte)};
  return each_file(file, [&](archive* reader, const fs::path& path, std::uintmax_t bytes) {
    return write_entry(reader, bytes, file, folder / path);
  });
}

}  // namespace veneer
