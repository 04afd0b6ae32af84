// The cell's memory: one SQLite file (docs/SCHEMA.md).
//
// WAL, synchronous=FULL, foreign keys, STRICT tables. A write that returned Ok() is on the disk. Every write is one
// IMMEDIATE transaction that commits last; any other way out leaves the file as it was.
//
// Threads: a Database is bound to the thread that uses it. The database thread opens the one read-write connection, and
// an exclusive lock on `<file>.lock` keeps every other writer out, in this process or another. Other threads open
// read-only connections; their reads never block the writer and see the last commit.
// Rows are written only by the stores of this folder, inside their transactions: any other statement that would write
// is refused, on this connection (db/guard.h) and, for rows, on every other (the schema calls functions that only this
// program has). What another program can still change, the schema and the index of wood, is not refused but found: the
// next transaction here notices that somebody wrote, and check_integrity() what. Until then no wood is booked and no
// job begins, since the rule that no wood is held twice looks in that index; what is under way goes on. Errors:
// exceptions of SQLiteCpp stop in db's .cc files. kStorage is the file or the disk, kUnavailable is another writer,
// kInvalidArgument a file that is not ours or newer than this program. Timestamps are ISO 8601 UTC strings with a
// trailing Z, passed in by the caller (base/clock.h), and compare as text.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <type_traits>

#include "base/result.h"

namespace SQLite {
class Database;
class Exception;
}  // namespace SQLite

namespace veneer::db {

struct Guard;
class WriterLock;

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

  // It was found damaged: from now on every write is refused with `why`, and the next start checks it whole, however
  // this one ends.
  void distrust(Error why);
  // Ok() while rows may be written. kUnavailable while needs_check(), kStorage once it is distrusted, or when its file
  // was moved or replaced, which is for good as well.
  Status may_write();
  // Why it has to be checked now, if anything happened since this was asked last: another program wrote to it, or a
  // row was found damaged. The next start checks it whole in any case.
  std::optional<std::string> take_doubt();
  // How often that has happened.
  int doubts() const { return doubts_; }
  // A check of the whole file that began after so many doubts has found nothing. Later ones stand.
  void dispel(int doubts);

  int schema_version() const;
  const std::filesystem::path& file() const { return file_; }
  // kStorage with what was found first when anything is not as it was written: pages, indices, foreign keys, the
  // schema, the checksum of a row, the index of wood. Reads the whole file, some seconds of a large one: on demand it
  // is called for a connection that reads, on a thread that may wait. kCancelled soon after `stop`.
  Status check_integrity(const std::stop_token& stop = {});
  // Limits the file to `pages` pages, so that a test can fill the disk.
  Status limit_pages_for_test(int pages);

  // For at_one_moment(). True when it is this call that began it; kStorage when SQLite has no memory for it.
  Result<bool> begin_moment();
  void end_moment() noexcept;

  // For db's own .cc files.
  SQLite::Database& connection() { return *connection_; }
  Guard& guard() { return *guard_; }
  void end_leftover();     // of a transaction that could not even be rolled back; throws SQLite::Exception
  void look_for_others();  // inside a transaction, where nobody else can write; throws SQLite::Exception
  // Inside a transaction that takes wood which nobody had before, or begins a job: kUnavailable while a doubt stands.
  // What happens to wood that a job has already, and to a job that runs, is written all the same.
  Status may_book() const;
  void failed(const SQLite::Exception& thrown) noexcept;  // what SQLite threw at a store, once all is rolled back

 private:
  Database(std::filesystem::path file, std::unique_ptr<WriterLock> lock, std::unique_ptr<SQLite::Database> connection);
  static Result<Database> open(const std::filesystem::path& file, bool check);
  void close() noexcept;
  bool was_replaced() const;
  void doubt(std::string why);

  std::filesystem::path file_;
  std::unique_ptr<WriterLock> lock_;  // null when read-only; released after the connection is closed
  std::unique_ptr<Guard> guard_;      // outlives the connection, which asks it
  std::unique_ptr<SQLite::Database> connection_;
  bool needs_check_ = false;
  std::optional<Error> distrusted_;
  int doubts_ = 0, dispelled_ = 0;  // how many came up, ever, and how many of these a check has dispelled
  std::optional<std::string> doubt_;
  int data_version_ = 0;  // SQLite's, of this connection: it changes with what others commit
};

// What `body` asks of `database`, a connection that reads, it is told of one moment, that of its first question,
// whatever is committed meanwhile: answers that belong together agree. `body` returns a Result or Status, and does not
// look for what it has others write meanwhile. Inside of another one it is a part of that. While it lasts the log
// beside the file only grows: nothing in it waits for people or for another disk.
template <class Body>
auto at_one_moment(Database& database, const Body& body) -> std::invoke_result_t<Body> {
  const Result<bool> begun = database.begin_moment();
  if (!begun.ok()) return begun.error();
  struct End {
    Database* of;
    ~End() {
      if (of != nullptr) of->end_moment();
    }
  } const end{*begun ? &database : nullptr};
  return body();
}

}  // namespace veneer::db
