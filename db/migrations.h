// The schema's history. Each migration is one .sql file of db/migrations/, embedded at build time.
#pragma once

#include <span>

#include "base/result.h"

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

// "VNER", so that another program's file is not taken for ours.
inline constexpr int kApplicationId = 0x564E4552;

struct Migration {
  int version;       // what user_version is after it; 1, 2, 3, ...
  const char* name;  // "0001_initial"
  const char* sql;
};

std::span<const Migration> migrations();

// Brings the schema from its user_version to the last migration's, one transaction each. A step that fails leaves the
// version before it. Refuses a schema newer than the last migration (kInvalidArgument).
Status migrate(SQLite::Database& connection, std::span<const Migration> steps);

}  // namespace veneer::db
