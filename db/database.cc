#include "db/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include "db/backup.h"
#include "db/clean_mark.h"
#include "db/guard.h"
#include "db/integrity.h"
#include "db/migrations.h"
#include "db/sql.h"
#include "db/writer_lock.h"

namespace veneer::db {
namespace {

constexpr int kBusyMs = 5000;  // a reader's checkpoint may hold the writer up for a moment

// Pragmas that hold for one connection only. Foreign keys are checked at the end of each statement.
void prepare(SQLite::Database& connection) {
  connection.exec("PRAGMA foreign_keys = ON");
  connection.exec("PRAGMA synchronous = FULL");
  connection.exec(
      "PRAGMA recursive_triggers = ON");  // a row that replaces another deletes it before the triggers' eyes
  register_functions(connection);
}

}  // namespace

Database::Database(std::filesystem::path file, std::unique_ptr<WriterLock> lock,
                   std::unique_ptr<SQLite::Database> connection)
    : file_(std::move(file)),
      lock_(std::move(lock)),
      guard_(std::make_unique<Guard>()),
      connection_(std::move(connection)) {
  set_guard(*connection_, *guard_);
}
Database::Database(Database&&) noexcept = default;
Database::~Database() { close(); }

// A clean end of the one that writes: nothing stays in the log, and what the file is like is written beside it.
void Database::close() noexcept {
  if (!connection_ || !lock_) return;
  bool checkpointed = false;
  try {
    look_for_others();
    SQLite::Statement checkpoint(*connection_, "PRAGMA wal_checkpoint(TRUNCATE)");
    checkpointed = checkpoint.executeStep() && checkpoint.getColumn(0).getInt() == 0;
  } catch (const SQLite::Exception&) {
    // Then the next start checks everything.
  }
  // What nobody has checked is checked by the next one.
  const bool known = checkpointed && !needs_check_ && !distrusted_ && doubts_ == 0 && !was_replaced();
  connection_ = nullptr;
  if (known) write_clean_mark(file_);
}

void Database::distrust(Error why) {
  if (!distrusted_) distrusted_ = std::move(why);
}

bool Database::was_replaced() const {
  int moved = 0;
  return sqlite3_file_control(connection_->getHandle(), "main", SQLITE_FCNTL_HAS_MOVED, &moved) == SQLITE_OK &&
         moved != 0;
}

Status Database::may_write() {
  if (!distrusted_ && lock_ && was_replaced()) {
    distrust({ErrorCode::kStorage,
              fmt::format("the file {} was moved or replaced while it was in use, so nothing is written any more: stop "
                          "veneerd, see that the right file is in its place, then start it",
                          file_.string())});
    doubt(distrusted_->message);
  }
  if (distrusted_) return *distrusted_;
  if (needs_check_)
    return Error{
        ErrorCode::kUnavailable,
        "the database was not closed in order and nothing is written before it has passed its check: try again in "
        "a minute"};
  return Ok();
}

void Database::doubt(std::string why) {
  ++doubts_;
  doubt_ = std::move(why);
}

void Database::dispel(int doubts) { dispelled_ = std::max(dispelled_, doubts); }

Status Database::may_book() const {
  if (dispelled_ == doubts_) return Ok();
  return Error{
      ErrorCode::kUnavailable,
      fmt::format("no wood is booked and no job begins before the database {} has been checked, because another "
                  "program wrote to it or a row of it is damaged: try again in a minute",
                  file_.string())};
}

std::optional<std::string> Database::take_doubt() { return std::exchange(doubt_, std::nullopt); }

// A rollback needs memory, too. Until it is made up for, what was half done would be read, and nothing could be
// written.
void Database::end_leftover() {
  if (!guard_->writing && !guard_->at_one_moment && sqlite3_get_autocommit(connection_->getHandle()) == 0)
    connection_->exec("ROLLBACK");
}

Result<bool> Database::begin_moment() {
  if (guard_->at_one_moment) return false;
  return guarded(*this, [this](SQLite::Database& connection) -> Result<bool> {
    connection.exec("BEGIN");
    guard_->at_one_moment = true;
    return true;
  });
}

// What cannot be rolled back now is end_leftover()'s.
void Database::end_moment() noexcept {
  guard_->at_one_moment = false;
  connection_->tryExec("ROLLBACK");
}

void Database::look_for_others() {
  const int found = connection_->execAndGet("PRAGMA data_version").getInt();
  if (std::exchange(data_version_, found) != found)
    doubt(
        fmt::format("another program wrote to the database {}: it has to be checked whole; let none but veneerd write "
                    "to it",
                    file_.string()));
}

void Database::failed(const SQLite::Exception& thrown) noexcept {
  if (!lock_) return;
  const int code = thrown.getErrorCode();
  try {
    if (means_damage(thrown)) doubt(to_error(thrown, file_.string()).message);
    // SQLite has dropped what it knew of the file, which looks like another program's write.
    if (code == SQLITE_FULL || code == SQLITE_IOERR)
      data_version_ = connection_->execAndGet("PRAGMA data_version").getInt();
  } catch (const std::exception&) {
    // Then a check comes that need not have been.
  }
}

Database& Database::operator=(Database&& other) noexcept {
  if (this == &other) return *this;
  close();  // while the old lock is still held
  file_ = std::move(other.file_);
  lock_ = std::move(other.lock_);
  connection_ = std::move(other.connection_);
  guard_ = std::move(other.guard_);
  needs_check_ = other.needs_check_;
  distrusted_ = std::move(other.distrusted_);
  doubts_ = other.doubts_;
  dispelled_ = other.dispelled_;
  doubt_ = std::move(other.doubt_);
  data_version_ = other.data_version_;
  return *this;
}

Result<Database> Database::open(const std::filesystem::path& file) { return open(file, true); }
Result<Database> Database::open_unchecked(const std::filesystem::path& file) { return open(file, false); }

Result<Database> Database::open(const std::filesystem::path& file, bool check) {
  auto taken = WriterLock::take(file);
  if (!taken) return taken.error();
  auto lock = std::make_unique<WriterLock>(std::move(*taken));
  // What a restore has decided and a power cut kept it from finishing.
  if (Status finished = finish_restore(file); !finished.ok()) return finished.error();
  const auto left = is_as_it_was_left(file);
  if (!left.ok()) return left.error();
  const bool clean = *left;
  if (Status removed = remove_clean_mark(file); !removed.ok()) return removed.error();
  // SQLite takes an empty file for a new one. What veneerd has made is never empty again.
  std::error_code failed;
  const auto size = std::filesystem::file_size(file, failed);
  const bool missing = failed == std::errc::no_such_file_or_directory;
  if (failed && !missing) return cannot_look_at(file, failed);
  if (missing) lock->note_gone();
  if (!missing && size == 0 && lock->was_made()) return is_damaged(file.string(), "it is empty");
  try {
    auto connection =
        std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyMs);
    // Of a file that may only be read SQLite makes a connection that reads.
    if (sqlite3_db_readonly(connection->getHandle(), "main") == 1) return may_not_be_written(file);
    const bool fresh = connection->execAndGet("SELECT count(*) FROM sqlite_schema").getInt() == 0;
    if (fresh)
      connection->exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
    else if (connection->execAndGet("PRAGMA application_id").getInt() != kApplicationId)
      return not_ours(file);
    prepare(*connection);
    const bool newest = connection->execAndGet("PRAGMA user_version").getInt() == migrations().back().version;
    if (!fresh && !clean)
      if (Status sound = !newest ? check_pages(*connection, file.string())
                         : check ? check_all(*connection, file.string())
                                 : check_schema(*connection, file.string());
          !sound.ok())
        return sound.error();
    connection->exec("PRAGMA journal_mode = WAL");
    if (Status migrated = migrate(*connection, migrations()); !migrated.ok()) return migrated.error();
    lock->note_made();
    Database database(file, std::move(lock), std::move(connection));
    database.needs_check_ = !check && !fresh && !clean && newest;
    database.data_version_ = database.connection_->execAndGet("PRAGMA data_version").getInt();
    return database;
  } catch (const SQLite::Exception& thrown) {
    return to_error(thrown, file.string());
  }
}

Result<Database> Database::open_for_reading(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file))
    return Error{ErrorCode::kNotFound, fmt::format("there is no database {}: start veneerd once", file.string())};
  try {
    auto connection = std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READONLY, kBusyMs);
    if (connection->execAndGet("PRAGMA application_id").getInt() != kApplicationId) return not_ours(file);
    const int found = connection->execAndGet("PRAGMA user_version").getInt();
    if (found != migrations().back().version)
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("the database {} has schema {}, this program reads schema {}: use programs of one version",
                      file.string(), found, migrations().back().version)};
    prepare(*connection);
    return Database(file, nullptr, std::move(connection));
  } catch (const SQLite::Exception& thrown) {
    return to_error(thrown, file.string());
  }
}

int Database::schema_version() const { return connection_->execAndGet("PRAGMA user_version").getInt(); }

Status Database::check_integrity(const std::stop_token& stop) {
  const Error cancelled{ErrorCode::kCancelled,
                        fmt::format("the check of {} was stopped before its end", file_.string())};
  if (stop.stop_requested()) return cancelled;
  sqlite3* const handle = connection_->getHandle();
  // The one ends what runs; the other sees to it that nothing begins after that.
  const std::stop_callback interrupt(stop, [handle] { sqlite3_interrupt(handle); });
  constexpr int kStepsBetweenLooks = 10'000;
  sqlite3_progress_handler(
      handle, kStepsBetweenLooks,
      [](void* token) { return static_cast<const std::stop_token*>(token)->stop_requested() ? 1 : 0; },
      const_cast<std::stop_token*>(&stop));  // NOLINT(cppcoreguidelines-pro-type-const-cast): SQLite's type
  Status sound = guarded(*this, [this](SQLite::Database& connection) { return check_all(connection, file_.string()); });
  sqlite3_progress_handler(handle, 0, nullptr, nullptr);
  if (!sound.ok() && stop.stop_requested()) return cancelled;
  if (!sound.ok()) return sound;
  needs_check_ = false;
  dispel(doubts_);  // all of them are of this thread, before the check
  return sound;
}

Status Database::limit_pages_for_test(int pages) {
  return guarded(*this, [pages](SQLite::Database& connection) -> Status {
    connection.execAndGet(fmt::format("PRAGMA max_page_count = {}", pages)).getInt();
    return Ok();
  });
}

}  // namespace veneer::db
