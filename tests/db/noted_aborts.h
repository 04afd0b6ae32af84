// The rows of `aborts`, as another program reads them: "STOP by anna", "cleared by bert".
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <filesystem>
#include <string>
#include <vector>

namespace veneer::db {

inline std::vector<std::string> noted_aborts(const std::filesystem::path& file) {
  SQLite::Database reading(file.string(), SQLite::OPEN_READONLY);
  SQLite::Statement rows(
      reading, "SELECT CASE cleared WHEN 1 THEN 'cleared by ' || who ELSE reason END FROM aborts ORDER BY id");
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(rows.getColumn(0).getString());
  return out;
}

}  // namespace veneer::db
