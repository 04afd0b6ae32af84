// Backups of a cell: folders that hold the database, every picture that its rows name, and a manifest with the hash of
// each (docs/schemas/backup.schema.json). A folder that has a backup's name was complete and was checked whole.
//
// Any thread that may wait; never the reactor. kStorage is the disk or a damaged file, kCancelled comes soon after
// `stop`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

inline constexpr const char* kDatabaseName = "veneerd.db";
// What is told of this cell, beside its database: no backup holds it.
inline constexpr const char *kAlarmsName = "alarms.json", *kTasksName = "tasks.json",
                            *kBedPictureName = "bed_picture.json";
inline constexpr const char* kManifestName = "manifest.json";

struct BackupFile {
  std::string file;  // relative to the backup's folder, and to the data folder
  std::uint64_t bytes = 0;
  std::string sha256;
};

struct BackupManifest {
  std::string made_at;
  BackupFile database;
  int schema = 0;
  std::int64_t panels = 0, jobs = 0, pieces = 0;
  std::vector<BackupFile> files;     // pictures
  std::vector<std::string> missing;  // named by rows, but not in the data folder as they were stored

  std::uint64_t bytes() const;  // of all files; those that are hard links take no room of their own
};
nlohmann::json to_json(const BackupManifest& manifest);

// How far it is, and what is going on.
using BackupProgress = std::function<void(double fraction, const std::string& text)>;

struct BackupPlace {
  std::filesystem::path data_dir, backup_dir;
  int keep = 14;                          // backups
  std::uint64_t spare_bytes = 256 << 20;  // what the disk must have left for the cell's own work
};

struct MadeBackup {
  std::filesystem::path folder;
  BackupManifest manifest;
  std::vector<std::string> removed;  // names of older ones
};

// Makes and checks a backup of what is committed now, named by `at` (UTC), while whoever writes goes on; pictures are
// hard links where the file system allows it, because they never change. A picture that cannot be read is missing.
// Then the oldest backups beyond `keep` are removed, but never this one, nor the newest that holds a picture which this
// one lacks. On an error nothing of it is left, and no older one is removed. kRefused when what was written did not
// pass the check, so that the database itself is in doubt; kConflict while another process makes one in that folder.
Result<MadeBackup> make_backup(const BackupPlace& place, const std::string& at, const std::stop_token& stop,
                               const BackupProgress& progress);

// Reads all of a backup: every file is there with its size and hash, the database is as it was written, and every
// picture that it names is here or known to be missing. kNotFound when the folder is no backup, kStorage names the
// first file that is damaged, kInvalidArgument when it is of a newer veneerd.
Result<BackupManifest> check_backup(const std::filesystem::path& folder, const std::stop_token& stop,
                                    const BackupProgress& progress);

// One folder with the name of a backup. Nothing but the manifest is read.
struct ListedBackup {
  std::string name;
  std::optional<BackupManifest> manifest;
  std::string fault;  // why there is none
};
// Newest first; none when there is no such folder.
std::vector<ListedBackup> list_backups(const std::filesystem::path& backup_dir);
// When the newest that can be read was made, as its manifest has it. Reads no other manifest.
std::optional<std::string> newest_backup_at(const std::filesystem::path& backup_dir);

// Can a row or a manifest mean a file below the data folder, and none of the database's own?
bool is_picture_path(std::string_view file);

}  // namespace veneer::daemon
