// Whether a database is as it was written. Private to db; these throw SQLite::Exception.
#pragma once

#include <string>

#include "base/result.h"

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

// Tables, indices, triggers and views are word for word those of this program's newest schema; tables that SQLite made
// by itself have the same columns, keys and rules, in whatever words. Milliseconds.
Status check_schema(SQLite::Database& connection, const std::string& file);

// Everything: SQLite's own check of pages and indices, foreign keys, the schema, the chain of the audit log, the
// checksum of every row, the index of wood against the wood, that no number can be handed out twice, and that each
// table has all its rows. Reads the whole file as it is at one moment, in a transaction of its own: others may write
// meanwhile.
Status check_all(SQLite::Database& connection, const std::string& file);

// What can be asked of an older schema before it is brought up to date: pages, indices and foreign keys.
Status check_pages(SQLite::Database& connection, const std::string& file);

}  // namespace veneer::db
