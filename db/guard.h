// What a connection may do beside reading: SQLite asks it for every statement (sqlite3_set_authorizer). Private to db.
//
// Rows are written only while a store's transaction is on (sql.h, in_transaction), the index of wood only by the
// ledger's own triggers, and the schema and what protects it not at all. A trigger cannot see to that: virtual tables
// have none, and a trigger can be dropped.
#pragma once

#include <functional>

namespace SQLite {
class Database;
}  // namespace SQLite

namespace veneer::db {

struct Guard {
  bool writing = false;
  bool at_one_moment = false;  // a transaction that only reads is on (Database::begin_moment)
  // Told where in the source each transaction stands that is committed, so that a test finds those that it never tries.
  std::function<void(const char* file, int line)> committed;
};

// `guard` outlives the connection. The schema must be as it is to stay.
void set_guard(SQLite::Database& connection, Guard& guard);

// Rows may be written while it lives.
class WritePermission {
 public:
  explicit WritePermission(Guard& guard) : guard_(guard) { guard_.writing = true; }
  WritePermission(const WritePermission&) = delete;
  WritePermission& operator=(const WritePermission&) = delete;
  ~WritePermission() { guard_.writing = false; }

 private:
  Guard& guard_;
};

}  // namespace veneer::db
