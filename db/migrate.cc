#include <fmt/format.h>

#include "db/migrations.h"
#include "db/sql.h"

namespace veneer::db {

Status migrate(SQLite::Database& connection, std::span<const Migration> steps) {
  const int last = steps.empty() ? 0 : steps.back().version;
  const std::string file = connection.getFilename();
  const char* step_name = "reading the version";
  try {
    const int found = connection.execAndGet("PRAGMA user_version").getInt();
    if (found > last)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the database {} has schema {}, this veneerd knows schemas up to {}: install the newer "
                               "veneerd that wrote it",
                               file, found, last)};
    for (const Migration& step : steps) {
      if (step.version <= found) continue;
      step_name = step.name;
      SQLite::Transaction transaction(connection, SQLite::TransactionBehavior::IMMEDIATE);
      connection.exec(step.sql);
      connection.exec(fmt::format("PRAGMA user_version = {}", step.version));
      transaction.commit();
    }
    return Ok();
  } catch (const SQLite::Exception& thrown) {
    const Error error = to_error(thrown, file);
    return Error{error.code, fmt::format("schema step {}: {}", step_name, error.message)};
  }
}

}  // namespace veneer::db
