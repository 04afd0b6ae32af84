#include "daemon/store/backup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "base/hash.h"
#include "db/backup.h"
#include "db/database.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// What is not complete yet, or not any more: what a killed daemon leaves of it goes before the next backup.
constexpr std::string_view kMaking = ".making-", kRemoving = ".removing-";

// "2026-05-01T07:30:00.123Z" as the name of a folder, also where colons have a meaning.
std::string name_of(std::string at) {
  std::replace(at.begin(), at.end(), ':', '-');
  return at;
}

bool is_name(const std::string& name) {
  constexpr std::string_view kForm = "dddd-dd-ddTdd-dd-dd.dddZ";
  return name.size() == kForm.size() && std::equal(name.begin(), name.end(), kForm.begin(), [](char c, char form) {
           return form == 'd' ? c >= '0' && c <= '9' : c == form;
         });
}

// Oldest first.
std::vector<std::string> names_in(const fs::path& backup_dir) {
  std::vector<std::string> names;
  std::error_code none;
  for (fs::directory_iterator at(backup_dir, none), end; !none && at != end; at.increment(none))
    if (std::string name = at->path().filename(); is_name(name) && at->is_directory(none))
      names.push_back(std::move(name));
  std::sort(names.begin(), names.end());
  return names;
}

void remove_leftovers(const fs::path& backup_dir) {
  std::vector<fs::path> left;
  std::error_code ignored;
  for (fs::directory_iterator at(backup_dir, ignored), end; !ignored && at != end; at.increment(ignored))
    if (const std::string name = at->path().filename(); name.starts_with(kMaking) || name.starts_with(kRemoving))
      left.push_back(at->path());
  for (const auto& folder : left) fs::remove_all(folder, ignored);
}

Error cannot_fill(const fs::path& backup_dir) {
  if (auto refused = disk_refuses(backup_dir)) return *std::move(refused);
  return {ErrorCode::kStorage, fmt::format("cannot write {}: make room on the disk or give the daemon access to this "
                                           "folder ([store] backup_dir), then try again",
                                           backup_dir.string())};
}

Error cancelled() { return {ErrorCode::kCancelled, "the backup was stopped before its end"}; }

Result<BackupFile> measured(const fs::path& folder, const std::string& file, const std::stop_token& stop) {
  const auto sha256 = sha256_hex_of_file(folder / file, stop);
  if (!sha256) return sha256.error();
  std::error_code failed;
  const auto bytes = fs::file_size(folder / file, failed);
  if (failed)
    return Error{ErrorCode::kStorage, fmt::format("cannot read {}: look at its disk", (folder / file).string())};
  return BackupFile{file, bytes, *sha256};
}

// Pictures are named by the first 16 digits of their hash ("map-0123456789abcdef.png"), plans by all 64: of others
// nobody can tell.
bool is_as_named(const BackupFile& picture) {
  constexpr std::size_t kDigits = 16;
  const std::string stem = fs::path(picture.file).stem();
  if (stem.size() < kDigits) return true;
  constexpr std::size_t kAll = 64;
  const std::string digits = stem.substr(stem.size() == kAll ? 0 : stem.size() - kDigits);
  const bool named = digits.find_first_not_of("0123456789abcdef") == std::string::npos;
  return !named || picture.sha256.starts_with(digits);
}

// Held while a backup is made: another cell's daemon would take what is half made for what a killed one left.
class FolderLock {
 public:
  static Result<FolderLock> take(const fs::path& backup_dir) {
    std::error_code ignored;
    fs::create_directories(backup_dir, ignored);
    FolderLock lock(::open(backup_dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (lock.fd_ < 0) return cannot_fill(backup_dir);
    if (::flock(lock.fd_, LOCK_EX | LOCK_NB) != 0)
      return Error{ErrorCode::kConflict,
                   fmt::format("another veneerd is making a backup in {}: give each cell a folder "
                               "of its own ([store] backup_dir)",
                               backup_dir.string())};
    return lock;
  }
  FolderLock(FolderLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  int fd_;
};

// Does a picture get a second name there, which takes no room? Tried with a file that is always there.
bool takes_links(const BackupPlace& place) {
  const fs::path link = place.backup_dir / (std::string(kMaking) + "link");
  std::error_code failed, ignored;
  fs::create_hard_link((place.data_dir / kDatabaseName).string() + ".lock", link, failed);
  fs::remove(link, ignored);
  return !failed;
}

std::uint64_t bytes_of_pictures(const fs::path& data_dir) {
  auto reading = db::Database::open_for_reading(data_dir / kDatabaseName);
  if (!reading) return 0;  // which is said when it is to be copied
  const auto contents = db::read_contents(*reading);
  std::uint64_t sum = 0;
  if (contents)
    for (const std::string& file : contents->files) {
      std::error_code missing;
      const auto bytes = fs::file_size(data_dir / file, missing);
      if (!missing) sum += bytes;
    }
  return sum;
}

// A disk that a backup fills breaks off what is being cut.
Status check_room(const BackupPlace& place) {
  std::uint64_t wanted = place.spare_bytes + (takes_links(place) ? 0 : bytes_of_pictures(place.data_dir));
  std::error_code none;
  for (const char* part : {"", "-wal"}) {
    const auto bytes = fs::file_size((place.data_dir / kDatabaseName).string() + part, none);
    if (!none) wanted += bytes;
  }
  const auto room = fs::space(place.backup_dir, none);
  if (none || room.available >= wanted) return Ok();
  constexpr std::uint64_t kMegabyte = 1 << 20;
  return Error{ErrorCode::kStorage,
               fmt::format("a backup needs {} MB free on the disk of {}, and {} MB are: make room, or name a folder on "
                           "another disk ([store] backup_dir)",
                           wanted / kMegabyte + 1, place.backup_dir.string(), room.available / kMegabyte)};
}

// A folder in which a backup is made; gone at the end unless it was given its name.
class Making {
 public:
  explicit Making(fs::path folder) : folder_(std::move(folder)) {}
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;
  ~Making() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

Status copy_pictures(const fs::path& data_dir, const fs::path& folder, const std::vector<std::string>& files,
                     BackupManifest& manifest, const std::stop_token& stop, const BackupProgress& progress) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (stop.stop_requested()) return cancelled();
    progress(0.3 + 0.3 * static_cast<double>(i) / static_cast<double>(files.size()),
             fmt::format("picture {} of {}", i + 1, files.size()));
    const std::string& file = files[i];
    std::error_code none;
    if (!is_picture_path(file) || fs::symlink_status(data_dir / file, none).type() != fs::file_type::regular) {
      manifest.missing.push_back(file);
      continue;
    }
    const Status shared = link_into(data_dir / file, folder / file);
    auto picture = shared ? measured(folder, file, stop) : Result<BackupFile>(shared.error());
    if (stop.stop_requested()) return cancelled();
    // One old picture that the disk does not give back any more must not cost the database's backup.
    if (!picture && sha256_hex_of_file(data_dir / file, stop)) return picture.error();
    if (picture && is_as_named(*picture)) {
      manifest.files.push_back(std::move(*picture));
      continue;
    }
    fs::remove(folder / file, none);
    manifest.missing.push_back(file);
  }
  return Ok();
}

Status copy_all(db::Database& source, const fs::path& data_dir, const fs::path& folder, BackupManifest& manifest,
                const std::stop_token& stop, const BackupProgress& progress) {
  std::error_code failed;
  if (!fs::create_directories(folder, failed)) return cannot_fill(folder.parent_path());
  const fs::path copy = folder / kDatabaseName;
  const auto copied = [&](double fraction) { progress(0.3 * fraction, "copying the database"); };
  if (Status done = db::copy_database(source, copy, copied, stop); !done) return done;
  auto reading = db::Database::open_for_reading(copy);
  if (!reading) return reading.error();
  const auto contents = db::read_contents(*reading);
  if (!contents) return contents.error();
  auto database = measured(folder, kDatabaseName, stop);
  if (!database) return database.error();
  manifest.database = std::move(*database);
  manifest.schema = contents->schema;
  manifest.panels = contents->panels, manifest.jobs = contents->jobs, manifest.pieces = contents->pieces;
  return copy_pictures(data_dir, folder, contents->files, manifest, stop, progress);
}

// Is a file missing because the row that names it was removed since the database was copied, as a plan may be?
bool was_removed_meanwhile(db::Database& source, const std::vector<std::string>& missing) {
  if (missing.empty()) return false;
  const auto now = db::read_contents(source);
  return now && std::ranges::any_of(
                    missing, [&](const std::string& file) { return !std::ranges::binary_search(now->files, file); });
}

Status fill(const BackupPlace& place, const fs::path& folder, BackupManifest& manifest, const std::stop_token& stop,
            const BackupProgress& progress) {
  auto source = db::Database::open_for_reading(place.data_dir / kDatabaseName);
  if (!source) return source.error();
  constexpr int kAttempts = 3;  // whoever removes plans all the time gets them as missing
  for (int attempt = 1;; ++attempt) {
    manifest.files.clear(), manifest.missing.clear();
    if (Status copied = copy_all(*source, place.data_dir, folder, manifest, stop, progress); !copied) return copied;
    if (attempt == kAttempts || !was_removed_meanwhile(*source, manifest.missing)) break;
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  const std::string text = to_json(manifest).dump(1) + "\n";
  if (Status written = write_whole(folder / kManifestName, std::as_bytes(std::span(text))); !written) return written;
  return sync_folders(folder);
}

json to_json(const BackupFile& file) { return {{"file", file.file}, {"bytes", file.bytes}, {"sha256", file.sha256}}; }

BackupFile file_from(const json& value) {
  return {value.at("file").get<std::string>(), value.at("bytes").get<std::uint64_t>(),
          value.at("sha256").get<std::string>()};
}

Result<BackupManifest> read_manifest(const fs::path& folder) {
  const fs::path file = folder / kManifestName;
  std::ifstream in(file, std::ios::binary);
  if (!in)
    return Error{ErrorCode::kNotFound,
                 fmt::format("{} is no backup, it has no {}: name a folder that `veneerctl db backups` lists",
                             folder.string(), kManifestName)};
  const Error damaged{ErrorCode::kStorage, fmt::format("{} is damaged: take another backup", file.string())};
  try {
    const json value = json::parse(in);
    if (const int version = value.at("schema_version"); version != 1)
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("{} has version {}, this veneerd reads version 1: install the newer veneerd that wrote it",
                      file.string(), version)};
    BackupManifest out;
    out.made_at = value.at("made_at").get<std::string>();
    out.database = file_from(value.at("database"));
    out.schema = value.at("database").at("schema");
    const json& counts = value.at("counts");
    out.panels = counts.at("panels"), out.jobs = counts.at("jobs"), out.pieces = counts.at("pieces");
    for (const json& picture : value.at("files")) out.files.push_back(file_from(picture));
    out.missing = value.at("missing").get<std::vector<std::string>>();
    const bool plain = std::all_of(out.files.begin(), out.files.end(),
                                   [](const BackupFile& picture) { return is_picture_path(picture.file); });
    if (!plain || out.database.file != kDatabaseName) return damaged;
    return out;
  } catch (const json::exception&) {
    return damaged;
  }
}

// The oldest beyond `keep`; what no clock says is `made`, the newest.
std::vector<std::string> remove_old(const fs::path& backup_dir, int keep, const std::string& made,
                                    const std::vector<std::string>& missing) {
  auto names = names_in(backup_dir);
  std::reverse(names.begin(), names.end());
  std::set<std::string> sought(missing.begin(), missing.end());
  std::vector<std::string> removed;
  for (std::size_t i = 0; i < names.size(); ++i) {
    bool stays = i < static_cast<std::size_t>(keep) || names[i] == made;
    if (!sought.empty())
      if (const auto manifest = read_manifest(backup_dir / names[i]))
        for (const BackupFile& picture : manifest->files)
          if (sought.erase(picture.file) > 0) stays = true;
    if (stays) continue;
    const fs::path dying = backup_dir / (std::string(kRemoving) + names[i]);
    std::error_code ignored;
    if (!move_folder_whole(backup_dir / names[i], dying).ok()) continue;
    fs::remove_all(dying, ignored);
    removed.push_back(names[i]);
  }
  std::reverse(removed.begin(), removed.end());
  return removed;
}

// As it was made, byte for byte.
Status check_file(const fs::path& folder, const BackupFile& file, const std::stop_token& stop) {
  const fs::path at = folder / file.file;
  std::error_code none;
  if (fs::symlink_status(at, none).type() != fs::file_type::regular)
    return Error{ErrorCode::kStorage, fmt::format("the backup lacks {}: take another one", at.string())};
  const auto found = measured(folder, file.file, stop);
  if (!found) return found.error();
  if (found->bytes == file.bytes && found->sha256 == file.sha256) return Ok();
  return Error{ErrorCode::kStorage,
               fmt::format("{} is not what was written into the backup: take another one", at.string())};
}

// Every picture that the rows name is here, or was missing when the backup was made. An older schema is not read.
Status check_names(const fs::path& copy, const BackupManifest& manifest) {
  auto reading = db::Database::open_for_reading(copy);
  if (!reading) return Ok();
  const auto contents = db::read_contents(*reading);
  if (!contents) return contents.error();
  std::set<std::string> known(manifest.missing.begin(), manifest.missing.end());
  for (const BackupFile& picture : manifest.files) known.insert(picture.file);
  for (const std::string& file : contents->files)
    if (!known.contains(file))
      return Error{ErrorCode::kStorage,
                   fmt::format("the backup {} does not hold {}, which its database names: take another one",
                               copy.parent_path().string(), file)};
  return Ok();
}

}  // namespace

std::uint64_t BackupManifest::bytes() const {
  std::uint64_t sum = database.bytes;
  for (const BackupFile& file : files) sum += file.bytes;
  return sum;
}

json to_json(const BackupManifest& manifest) {
  json database = to_json(manifest.database);
  database["schema"] = manifest.schema;
  json files = json::array();
  for (const BackupFile& file : manifest.files) files.push_back(to_json(file));
  return {{"schema_version", 1},
          {"made_at", manifest.made_at},
          {"database", std::move(database)},
          {"counts", {{"panels", manifest.panels}, {"jobs", manifest.jobs}, {"pieces", manifest.pieces}}},
          {"files", std::move(files)},
          {"missing", manifest.missing}};
}

bool is_picture_path(std::string_view file) {
  const fs::path path(file);
  if (path.empty() || path.is_absolute() || path != path.lexically_normal() || !path.has_filename()) return false;
  // Pictures are in folders; beside the database there is only what belongs to it.
  return std::distance(path.begin(), path.end()) > 1 && path.begin()->string() != "..";
}

Result<BackupManifest> check_backup(const fs::path& folder, const std::stop_token& stop,
                                    const BackupProgress& progress) {
  auto manifest = read_manifest(folder);
  if (!manifest) return manifest;
  const double all = static_cast<double>(manifest->bytes()) + 1;
  double read = 0;
  std::vector<BackupFile> files = manifest->files;
  files.push_back(manifest->database);
  for (std::size_t i = 0; i < files.size(); ++i) {
    progress(0.8 * read / all, fmt::format("checking file {} of {}", i + 1, files.size()));
    if (Status same = check_file(folder, files[i], stop); !same) return same.error();
    read += static_cast<double>(files[i].bytes);
  }
  progress(0.8, "checking the database");
  const fs::path copy = folder / kDatabaseName;
  const auto schema = db::check_copy(copy, stop);
  if (!schema) {
    if (schema.error().code != ErrorCode::kStorage) return schema.error();
    return Error{ErrorCode::kStorage, fmt::format("the database of the backup {} is damaged ({}): take another backup",
                                                  folder.string(), schema.error().message)};
  }
  if (*schema != manifest->schema)
    return Error{ErrorCode::kStorage, fmt::format("{} has schema {}, its manifest says {}: take another backup",
                                                  copy.string(), *schema, manifest->schema)};
  if (Status names = check_names(copy, *manifest); !names) return names.error();
  return manifest;
}

Result<MadeBackup> make_backup(const BackupPlace& place, const std::string& at, const std::stop_token& stop,
                               const BackupProgress& progress) {
  const std::string name = name_of(at);
  const fs::path folder = place.backup_dir / name;
  std::error_code none;
  if (fs::exists(folder, none))
    return Error{ErrorCode::kConflict, fmt::format("there is a backup {} already: try again", folder.string())};
  const auto lock = FolderLock::take(place.backup_dir);
  if (!lock) return lock.error();
  remove_leftovers(place.backup_dir);
  if (Status room = check_room(place); !room) return room.error();
  const Making making(place.backup_dir / (std::string(kMaking) + name));
  MadeBackup made{folder, {}, {}};
  made.manifest.made_at = at;
  if (Status filled = fill(place, making.folder(), made.manifest, stop, progress); !filled) return filled.error();
  const auto checked = [&](double fraction, const std::string& text) { progress(0.6 + 0.4 * fraction, text); };
  if (const auto sound = check_backup(making.folder(), stop, checked); !sound) {
    if (sound.error().code != ErrorCode::kStorage) return sound.error();
    return Error{ErrorCode::kRefused,
                 fmt::format("the new backup did not pass its check and was removed again ({}): let `veneerctl db "
                             "check` read the database",
                             sound.error().message)};
  }
  if (Status named = move_folder_whole(making.folder(), folder); !named) return named.error();
  made.removed = remove_old(place.backup_dir, place.keep, name, made.manifest.missing);
  return made;
}

std::vector<ListedBackup> list_backups(const fs::path& backup_dir) {
  std::vector<ListedBackup> out;
  for (std::string& name : names_in(backup_dir)) {
    auto manifest = read_manifest(backup_dir / name);
    out.push_back({std::move(name), {}, {}});
    if (manifest)
      out.back().manifest = std::move(*manifest);
    else
      out.back().fault = manifest.error().message;
  }
  std::reverse(out.begin(), out.end());
  return out;
}

std::optional<std::string> newest_backup_at(const fs::path& backup_dir) {
  const std::vector<std::string> names = names_in(backup_dir);
  for (auto name = names.rbegin(); name != names.rend(); ++name)
    if (const auto manifest = read_manifest(backup_dir / *name)) return manifest->made_at;
  return std::nullopt;
}

}  // namespace veneer::daemon
