#include <fmt/format.h>
#include <sqlite3.h>

#include "db/migrations.h"
#include "db/plan_files.h"
#include "db/sql.h"
#include "db/table_sums.h"

namespace veneer::db {

namespace {

// A step may build a table anew; that its rows still point to each other is checked before it is committed. SQLite
// ignores this pragma within a transaction.
class ForeignKeysOff {
 public:
  explicit ForeignKeysOff(SQLite::Database& connection)
      : connection_(connection), were_on_(connection.execAndGet("PRAGMA foreign_keys").getInt() != 0) {
    connection_.exec("PRAGMA foreign_keys = OFF");
  }
  ForeignKeysOff(const ForeignKeysOff&) = delete;
  ForeignKeysOff& operator=(const ForeignKeysOff&) = delete;
  ~ForeignKeysOff() {
    if (were_on_) connection_.tryExec("PRAGMA foreign_keys = ON");
  }

 private:
  SQLite::Database& connection_;
  bool were_on_;
};

}  // namespace

Status migrate(SQLite::Database& connection, std::span<const Migration> steps) {
  const int last = steps.empty() ? 0 : steps.back().version;
  const std::string file = connection.getFilename();
  const char* step_name = nullptr;
  try {
    const int found = connection.execAndGet("PRAGMA user_version").getInt();
    if (found > last)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the database {} has schema {}, this veneerd knows schemas up to {}: install the newer "
                               "veneerd that wrote it",
                               file, found, last)};
    const ForeignKeysOff rebuilding(connection);
    const KeepPlanFunction keeping(connection);
    for (const Migration& step : steps) {
      if (step.version <= found) continue;
      step_name = step.name;
      SQLite::Transaction transaction(connection, SQLite::TransactionBehavior::IMMEDIATE);
      connection.exec(step.sql);
      // A step may have made tables, or made some anew, which loses their triggers.
      if (step.version == last) keep_sums(connection);
      SQLite::Statement lost(connection, "PRAGMA foreign_key_check");
      if (lost.executeStep())
        throw SQLite::Exception("table " + text(lost.getColumn(0)) + " points to a row that is not there",
                                SQLITE_CORRUPT);
      connection.exec(fmt::format("PRAGMA user_version = {}", step.version));
      transaction.commit();
    }
    return Ok();
  } catch (const SQLite::Exception& thrown) {
    const Error error = to_error(thrown, file);
    if (step_name == nullptr) return error;
    return Error{error.code, fmt::format("in schema step {} {}", step_name, error.message)};
  }
}

}  // namespace veneer::db
