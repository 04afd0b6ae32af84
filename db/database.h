// The cell's memory: one SQLite file (docs/SCHEMA.md).
//
// WAL, synchronous=FULL, foreign keys, STRICT tables. A write that returned Ok() is on the disk. Every write is one
// IMMEDIATE transaction that commits last; any other way out leaves the file as it was.
//
// Threads: a Database is bound to the thread that uses it. The database thread opens the one read-write connection, and
// an exclusive lock on `<file>.lock` keeps every other writer out, in this process or another. Other threads open
// read-only connections; their reads never block the writer and see the last commit.
// Rows are written only by the stores of this folder, inside their transactions: any other statement that would write
// is refused, on this connection (db/guard.h) and on every other (the schema calls functions that only this program
// has). Errors: exceptions of SQLiteCpp stop in db's .cc files. kStorage is the file or the disk, kUnavailable is
// another writer, kInvalidArgument a file that is not ours or newer than this program. Timestamps are ISO 8601 UTC
// strings with a trailing Z, passed in by the caller (base/clock.h), and compare as text.
#pragma once

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

struct Guard;

class Database {
 public:
  // Read-write; creates the file and its folder, brings an older schema up to date. A file that is byte for byte as its
  // last writer left it is opened at once; any other, after a kill or a power cut, is checked whole first, and refused
  // when it is damaged.
  static Result<Database> open(const std::filesystem::path& file);
  // The same without that wait, for whoever checks it next: only the schema is looked at, and an older schema whole
  // before it is brought up to date. While needs_check() is true every write is refused.
  static Result<Database> open_unchecked(const std::filesystem::path& file);
  // Read-only; the file must exist with this program's schema.
  static Result<Database> open_for_reading(const std::filesystem::path& file);

  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  // Not as its last writer left it, and check_integrity() has not passed since it was opened.
  bool needs_check() const { return needs_check_; }

  int schema_version() const;
  const std::filesystem::path& file() const { return file_; }
  // kStorage with what was found first when anything is not as it was written: pages, indices, foreign keys, the
  // schema, the checksum of a row, the index of wood. Reads the whole file, some seconds of a large one: on demand it
  // is called for a connection that reads, on a thread that may wait. kCancelled soon after `stop`.
  Status check_integrity(const std::stop_token& stop = {});
  // Limits the file to `pages` pages, so that a test can fill the disk.
  Status limit_pages_for_test(int pages);

  // For db's own .cc files.
  SQLite::Database& connection() { return *connection_; }
  Guard& guard() { return *guard_; }

 private:
  struct Lock;
  Database(std::filesystem::path file, std::unique_ptr<Lock> lock, std::unique_ptr<SQLite::Database> connection);
  static Result<Database> open(const std::filesystem::path& file, bool check);
  void close() noexcept;

  std::filesystem::path file_;
  std::unique_ptr<Lock> lock_;    // null when read-only; released after the connection is closed
  std::unique_ptr<Guard> guard_;  // outlives the connection, which asks it
  std::unique_ptr<SQLite::Database> connection_;
  bool needs_check_ = false;
};

}  // namespace veneer::db
