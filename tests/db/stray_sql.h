// SQL that no store of ours would write, for the tests of db: from inside the program and from outside.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <fstream>
#include <span>
#include <sstream>
#include <string>

#include "base/hash.h"
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

// As a disk that changed a row in a way that no check at the start has seen: every `was` in the closed file reads `is`
// (of the same length), and the file passes for the one its last writer left.
inline void damage_unseen(const std::filesystem::path& file, const std::string& was, const std::string& is) {
  std::ostringstream read;
  read << std::ifstream(file, std::ios::binary).rdbuf();
  std::string bytes = read.str();
  ASSERT_EQ(was.size(), is.size());
  ASSERT_NE(bytes.find(was), std::string::npos);
  for (auto at = bytes.find(was); at != std::string::npos; at = bytes.find(was, at)) bytes.replace(at, was.size(), is);
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  std::ofstream(file.string() + ".clean") << sha256_hex(std::as_bytes(std::span(bytes))) << '\n';
}

}  // namespace veneer::db
