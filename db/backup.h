// Copies of a database that is in use, and their way back into its place. What else belongs to a backup, the pictures
// and the manifest, is the daemon's (daemon/store/backup.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

// What a database holds, in numbers, and the files beside it that its rows name.
struct Contents {
  int schema = 0;
  std::int64_t panels = 0, jobs = 0, pieces = 0;  // all that were ever entered
  std::vector<std::string> files;                 // relative to the data folder, sorted, each once
};
Result<Contents> read_contents(Database& database);

// Copies the database as it is at its last commit to `copy`, a name that is not taken: a plain file without a log,
// synced, whose own name is not. `source` is a connection that reads, on a thread that may wait; whoever writes goes on
// meanwhile. `progress` is told the fraction that is done. On any error nothing is left: kStorage when the disk does
// not take it, kCancelled soon after `stop`.
Status copy_database(Database& source, const std::filesystem::path& copy, const std::function<void(double)>& progress,
                     const std::stop_token& stop);

// The schema of a copy that is as it was written: checked whole where the schema is this program's, else by what can be
// asked of an older one. kStorage names what was found first, and is no full sentence; kInvalidArgument when it is
// another program's file, or newer than this program.
Result<int> check_copy(const std::filesystem::path& copy, const std::stop_token& stop);

// Writes into a copy before it takes the place of a database: brings it up to date, lets `work` write, and leaves one
// plain file again, synced. Its folder is the one in which it will be opened, since plans of older schemas become files
// there. On an error it is no copy any more.
Status change_copy(const std::filesystem::path& copy, const std::function<Status(Database&)>& work);

// Puts a synced file of the same file system in the place of a database that nobody has open. The caller holds the
// WriterLock. A power cut leaves the one or the other: from the moment at which the new one has the name
// `<file>.restored` it counts, and the next Database::open() finishes what is left to do. `decided` is called then, so
// that a test can cut the power there.
Status replace_database(const std::filesystem::path& made, const std::filesystem::path& file,
                        const std::function<void()>& decided = {});
Status finish_restore(const std::filesystem::path& file);

}  // namespace veneer::db
