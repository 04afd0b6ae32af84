#include "db/backup.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <memory>
#include <system_error>

#include "base/files.h"
#include "db/integrity.h"
#include "db/migrations.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

namespace fs = std::filesystem;

constexpr int kPagesAtOnce = 256;  // a megabyte, until somebody may stop it

fs::path restored_name(const fs::path& file) { return file.string() + ".restored"; }

// SQLITE_DONE when all was copied, SQLITE_INTERRUPT when somebody stopped it before, else what SQLite says.
int copy_pages(sqlite3* source, sqlite3* copy, const std::function<void(double)>& progress,
               const std::stop_token& stop) {
  sqlite3_backup* const work = sqlite3_backup_init(copy, "main", source, "main");
  if (work == nullptr) return sqlite3_errcode(copy);
  int code = SQLITE_OK;
  while (code == SQLITE_OK) {
    code = stop.stop_requested() ? SQLITE_INTERRUPT : sqlite3_backup_step(work, kPagesAtOnce);
    if (const int pages = sqlite3_backup_pagecount(work); pages > 0 && progress)
      progress(1.0 - static_cast<double>(sqlite3_backup_remaining(work)) / pages);
  }
  const int ended = sqlite3_backup_finish(work);
  return ended == SQLITE_OK ? code : ended;
}

// A new file is only written, and nobody else has it: what fails to be read, or is held by others, is the source.
bool is_of_the_source(int code) {
  switch (code & 0xff) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return true;
    default:
      return code == SQLITE_IOERR_READ || code == SQLITE_IOERR_SHORT_READ || code == SQLITE_IOERR_LOCK ||
             code == SQLITE_IOERR_RDLOCK || code == SQLITE_IOERR_CORRUPTFS;
  }
}

// Within one moment of the source, whatever is committed meanwhile. `failing` is the file that an exception is about.
// kCancelled: a stop was requested.
Status copy_snapshot(Database& source, const fs::path& file, const std::function<void(double)>& progress,
                     const std::stop_token& stop, const fs::path*& failing) {
  failing = &source.file();
  // Only the first read fixes what is seen.
  static_cast<void>(source.connection().execAndGet("SELECT count(*) FROM sqlite_schema").getInt());
  failing = &file;
  SQLite::Database copy(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  copy.exec("PRAGMA synchronous = FULL");
  const int code = copy_pages(source.connection().getHandle(), copy.getHandle(), progress, stop);
  if (code == SQLITE_DONE) return Ok();
  if (code == SQLITE_INTERRUPT) return Error{ErrorCode::kCancelled, "the backup was stopped before its end"};
  if (is_of_the_source(code)) failing = &source.file();
  throw SQLite::Exception(copy.getHandle(), code & 0xff);
}

// The source's header says that there is a log beside the file; a copy on a disc that only reads could not be opened
// so.
void drop_log(const fs::path& file) {
  SQLite::Database copy(file.string(), SQLite::OPEN_READWRITE);
  copy.exec("PRAGMA synchronous = FULL");
  if (copy.execAndGet("PRAGMA journal_mode = DELETE").getString() != "delete")
    throw SQLite::Exception("the log of a copy cannot be dropped", SQLITE_ERROR);
}

Result<int> check_older(const fs::path& file) {
  const std::string name = file.string();
  SQLite::Database connection(name, SQLite::OPEN_READONLY);
  if (connection.execAndGet("PRAGMA application_id").getInt() != kApplicationId) return not_ours(file);
  register_functions(connection);
  const int schema = connection.execAndGet("PRAGMA user_version").getInt();
  const int newest = migrations().back().version;
  if (schema > newest)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} has schema {}, this veneerd knows schemas up to {}: install the newer veneerd that "
                             "wrote it",
                             name, schema, newest)};
  if (schema == newest) return schema;
  if (const Status sound = check_pages(connection, name); !sound.ok()) return sound.error();
  return schema;
}

}  // namespace

Result<Contents> read_contents(Database& database) {
  const auto read = [&](SQLite::Database& connection) -> Result<Contents> {
    Contents out;
    out.schema = database.schema_version();
    const auto count = [&](const char* table) {
      return connection.execAndGet(fmt::format("SELECT count(*) FROM {}", table)).getInt64();
    };
    out.panels = count("panels"), out.jobs = count("jobs"), out.pieces = count("pieces");
    SQLite::Statement files(
        connection,
        "SELECT map_file AS file FROM masks UNION SELECT mask_file FROM masks UNION "
        "SELECT file FROM scans UNION SELECT target_file FROM plans UNION "
        "SELECT preview_file FROM plans UNION SELECT 'plans/' || plan_sha256 || '.json' FROM plans "
        "UNION SELECT CASE WHEN json_valid(options_json) THEN options_json ->> '$.segmentation_file' END "
        "FROM plans UNION SELECT seen_file FROM painted_masks UNION SELECT picture_file FROM remnants UNION "
        "SELECT f.file FROM (SELECT id, map_file AS "
        "file FROM proposals UNION SELECT id, mask_file FROM proposals UNION SELECT id, read_file "
        "FROM proposals UNION SELECT p.id, e.value FROM proposals AS p, json_each(p.scan_files) AS "
        "e) AS f WHERE NOT EXISTS (SELECT 1 FROM proposal_verdicts WHERE proposal = f.id) ORDER BY "
        "file");
    while (files.executeStep())
      if (std::string file = text(files.getColumn(0)); !file.empty()) out.files.push_back(std::move(file));
    return out;
  };
  return at_one_moment(database, [&] { return guarded(database, read); });
}

Status copy_database(Database& source, const fs::path& copy, const std::function<void(double)>& progress,
                     const std::stop_token& stop) {
  Status done = Ok();
  const fs::path* failing = &copy;
  try {
    done = at_one_moment(source, [&] { return copy_snapshot(source, copy, progress, stop, failing); });
    if (done.ok()) drop_log(copy);
  } catch (const SQLite::Exception& thrown) {
    done = to_error(thrown, failing->string());
  }
  std::error_code ignored;
  if (!done.ok())
    for (const char* part : {"", "-journal", "-wal", "-shm"}) fs::remove(copy.string() + part, ignored);
  return done;
}

Status change_copy(const fs::path& copy, const std::function<Status(Database&)>& work) {
  const auto remove_what_is_beside_it = [&] {
    std::error_code ignored;
    for (const char* part : {"-journal", "-wal", "-shm", ".clean", ".lock"}) fs::remove(copy.string() + part, ignored);
  };
  remove_what_is_beside_it();  // the log of one that was cut short is another file's
  Status done = [&]() -> Status {
    auto database = Database::open(copy);
    if (!database) return database.error();
    return work(*database);
  }();
  try {
    if (done.ok()) drop_log(copy);
  } catch (const SQLite::Exception& thrown) {
    done = to_error(thrown, copy.string());
  }
  remove_what_is_beside_it();
  return done;
}

Result<int> check_copy(const fs::path& copy, const std::stop_token& stop) {
  const std::string name = copy.string();
  Result<int> schema = [&]() -> Result<int> {
    try {
      return check_older(copy);
    } catch (const SQLite::Exception& thrown) {
      return to_error(thrown, name);
    }
  }();
  if (schema && *schema == migrations().back().version) {
    auto opened = Database::open_for_reading(copy);
    if (const Status sound = opened ? opened->check_integrity(stop) : Status(opened.error()); !sound.ok())
      schema = sound.error();
  }
  if (!schema && schema.error().code == ErrorCode::kStorage)
    return Error{ErrorCode::kStorage, what_is_damaged(name, schema.error())};
  return schema;
}

Status replace_database(const fs::path& made, const fs::path& file, const std::function<void()>& decided) {
  if (Status moved = move_whole(made, restored_name(file)); !moved.ok()) return moved;
  if (decided) decided();
  return finish_restore(file);
}

Status finish_restore(const fs::path& file) {
  std::error_code failed;
  const bool decided = fs::exists(restored_name(file), failed);
  if (failed) return cannot_look_at(restored_name(file), failed);
  if (!decided) return Ok();
  // What is left of the log of the file before would be taken for the new one's.
  for (const char* part : {"-wal", "-shm", "-journal", ".clean"})
    if (Status removed = remove_durably(file.string() + part); !removed.ok()) return removed;
  return move_whole(restored_name(file), file);
}

}  // namespace veneer::db
