// A backup in the place of a cell's data, while no veneerd runs; also into a data folder that is not there yet, on
// another machine.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "daemon/store/backup.h"

namespace veneer::daemon {

struct Restored {
  std::filesystem::path backup, data_dir;
  BackupManifest manifest;
  std::filesystem::path aside;     // what was moved there; "" when nothing was in the way
  std::size_t placed = 0;          // pictures that were not there, or not as they were stored
  bool nothing_cut_since = false;  // as somebody said who knows
};

// `backup` is a backup's folder, or one as a file (base/archive.h), which is unpacked into the data folder first.
// Reads and checks all of the backup before anything is touched. What it replaces, the database above all, is kept in a
// folder "before-restore-..." of the data folder, named by `at` (UTC); pictures that the backup does not know stay
// where they are. A power cut leaves the old database or the new one, with all its pictures.
//
// kUnavailable while a veneerd holds the data folder; kRefused when the data folder belongs to another user, who could
// not read what is put there; else as check_backup(). `before_step` is called before each change of the disk, so that a
// test can cut the power there.
Result<Restored> restore_backup(const std::filesystem::path& backup, const std::filesystem::path& data_dir,
                                const std::string& at, const BackupProgress& progress,
                                const std::function<void()>& before_step = {});

// Says in the audit log of the database that is in place now who put it there; brings an older schema up to date.
// Unless nothing was cut since the backup was made, panels count as unseen until they are scanned
// (Panels::check_seen_since_restore).
Status note_restore(const Restored& restored, const std::string& who, const std::string& at);

// What was done, for whoever asked for it.
std::string describe(const Restored& restored);

}  // namespace veneer::daemon
