// The checksum that every row of the schema carries, as SQL function veneer_checksum(table, column, ...). Private to
// db.
//
// It finds what a disk or a stray program changed; it is no signature. Each step of it can be undone, so that two rows
// that differ in a single bit never have the same one.
#pragma once

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

// Registers it, deterministic, so that generated columns may use it.
void register_checksum(SQLite::Database& connection);

}  // namespace veneer::db
