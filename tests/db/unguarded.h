// What this program's own guard refuses, done on its connection; the guard is gone from it then.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

namespace veneer::db {

inline void exec_unguarded(SQLite::Database& connection, const char* sql) {
  sqlite3_set_authorizer(connection.getHandle(), nullptr, nullptr);
  connection.exec(sql);
}

}  // namespace veneer::db
