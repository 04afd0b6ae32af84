// A backup in the place of a cell's data, while no veneerd runs; also into a data folder that is not there yet, on
// another machine.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/store/backup.h"
#include "db/accounts.h"
#include "db/certificates.h"

namespace veneer::daemon {

struct RestoreOrder {
  std::filesystem::path backup;  // a backup's folder, or one as a file (base/archive.h)
  std::filesystem::path data_dir;
  std::string who, at;             // for the audit log
  bool nothing_cut_since = false;  // as somebody says who knows
};

struct Restored {
  std::filesystem::path backup, data_dir;
  BackupManifest manifest;
  std::filesystem::path aside;                      // what was moved there; "" when nothing was in the way
  std::size_t placed = 0;                           // pictures that were not there, or not as they were stored
  bool nothing_cut_since = false;                   // as somebody said who knows
  std::optional<std::string> clear_owed;            // why the cell is to be cleared, though the backup may not say so
  std::vector<db::CertificateRecord> certificates;  // that count now
  std::vector<db::UserRecord> users;                // who may sign in now, with the roles and passwords of then
};

// A backup that is a file is unpacked into the data folder first. Reads and checks all of the backup before anything is
// touched. What it replaces, the database above all, and the alarms and tasks that were told of it are kept in a folder
// "before-restore-..." of the data folder, named by `at` (UTC); pictures that the backup does not know stay where they
// are. A power cut leaves the old database or the new one, with all its pictures, of today's schema, with who put it
// there in its audit log; and unless nothing was cut since the backup was made, with panels that count as unseen until
// they are scanned (Panels::check_seen). A Clear that the database before it owed, or may have owed where it cannot be
// read, is owed by the new one, whatever was cut since. Alarms and tasks are numbered from 1 again.
//
// kUnavailable while a veneerd holds the data folder; kRefused when the data folder belongs to another user, who could
// not read what is put there; else as check_backup(). `before_step` is called before each change of the disk, so that a
// test can cut the power there.
Result<Restored> restore_backup(const RestoreOrder& order, const BackupProgress& progress,
                                const std::function<void()>& before_step = {});

// What was done, for whoever asked for it. `devices`: which ones the cell has here, since no backup says so.
std::string describe(const Restored& restored, const std::string& devices = "");

}  // namespace veneer::daemon
