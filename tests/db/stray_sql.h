// SQL that no store of ours would write, for the tests of db: from inside the program and from outside.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/sql.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

// Inside a store's transaction, where rows may be written: only the schema's own rules stand in the way.
inline Status execute(Database& database, const std::string& sql) {
  return in_transaction(database, [&](SQLite::Database& connection) -> Status {
    connection.exec(sql);
    return Ok();
  });
}

// As somebody who knows the program's functions and means harm: he may drop what stands in his way.
inline void tamper(const std::filesystem::path& file, const std::string& sql) {
  SQLite::Database connection(file.string(), SQLite::OPEN_READWRITE, 5000);
  register_functions(connection);
  connection.exec(sql);
}

// As somebody with the sqlite3 shell. What SQLite answers, "" when it did as told.
inline std::string stray(const std::filesystem::path& file, const std::string& sql) {
  try {
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE, 5000).exec(sql);
    return "";
  } catch (const SQLite::Exception& thrown) {
    return thrown.what();
  }
}

}  // namespace veneer::db
