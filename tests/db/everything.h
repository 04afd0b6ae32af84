// All that a database says, as one text: what must be the same before and after.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>
#include <vector>

namespace veneer::db {

inline std::vector<std::string> texts(SQLite::Database& connection, const std::string& query) {
  SQLite::Statement rows(connection, query);
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(rows.getColumn(0).getString());
  return out;
}

inline std::vector<std::string> tables(SQLite::Database& connection) {
  return texts(connection,
               "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%' AND name NOT LIKE "
               "'allocation_boxes_%' ORDER BY name");
}

// Every value of every row of every table.
inline std::string rows_in(SQLite::Database& connection) {
  std::string out;
  const auto add = [&](const std::string& query) {
    SQLite::Statement rows(connection, query);
    while (rows.executeStep())
      for (int i = 0; i < rows.getColumnCount(); ++i)
        out += rows.getColumn(i).isNull() ? "null|" : rows.getColumn(i).getString() + "|";
  };
  for (const auto& table : tables(connection)) add("SELECT * FROM " + table + " ORDER BY 1, 2, 3");
  add("SELECT s.name, s.seq FROM sqlite_sequence AS s ORDER BY s.name");
  return out;
}

// And of the schema and of the header's fields that we use.
inline std::string everything_in(SQLite::Database& connection) {
  std::string out = rows_in(connection);
  for (const auto& text : texts(connection,
                                "SELECT type || '|' || name || '|' || tbl_name || '|' || coalesce(sql, 'null') FROM "
                                "sqlite_schema ORDER BY name"))
    out += text + "|";
  for (const char* field : {"user_version", "application_id"})
    out += connection.execAndGet(std::string("PRAGMA ") + field).getString() + "|";
  return out;
}

}  // namespace veneer::db
