// What plans say in full, as files beside the database: `plans/<SHA-256>.json`, written whole and never changed. The
// row of a plan keeps the hash and the size, and is committed only when its file is on the disk. Private to db.
//
// Any thread that may wait for a disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

struct PlanFile {
  std::string sha256;
  std::int64_t bytes = 0;
};

// As a row of the backup's list: relative to the folder of the database.
std::string plan_file_name(const std::string& sha256);

// `database` is the database's own file. kStorage when the disk does not take it.
Result<PlanFile> keep_plan_file(const std::filesystem::path& database, const std::string& text);
// kStorage when it is missing or not what was written.
Result<std::string> read_plan_file(const std::filesystem::path& database, const PlanFile& file);
Status remove_plan_file(const std::filesystem::path& database, const std::string& sha256);

// For a schema step: the SQL function veneer_keep_plan(text), which keeps the text as a file of the connection's
// database and gives its hash. It is there for as long as this lives.
class KeepPlanFunction {
 public:
  explicit KeepPlanFunction(SQLite::Database& connection);
  KeepPlanFunction(const KeepPlanFunction&) = delete;
  KeepPlanFunction& operator=(const KeepPlanFunction&) = delete;
  ~KeepPlanFunction();

 private:
  SQLite::Database& connection_;
  std::filesystem::path file_;
};

}  // namespace veneer::db
