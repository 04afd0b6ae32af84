// How many rows each table has and the exclusive or of their checksums, kept by triggers in `table_sums`. Rows that are
// gone with their page are each as they were written; that they are missing is seen here. Private to db; these throw
// SQLite::Exception.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

// All tables that have checksums, by name.
std::vector<std::string> tables_with_checksums(SQLite::Database& connection);

// Makes the triggers of all of them anew and counts. In the transaction of the last schema step; schemas before 20 have
// no sums.
void keep_sums(SQLite::Database& connection);

// Empty when all tables have the rows that were written to them; else the table, and what it has.
std::string first_wrong_sum(SQLite::Database& connection);

}  // namespace veneer::db
