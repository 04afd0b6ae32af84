// How often a piece of work asks the database: what looks at a thousand panels must not ask a thousand times.
#pragma once

#include <SQLiteCpp/Database.h>
#include <sqlite3.h>

#include <atomic>

#include "db/database.h"

namespace veneer::db {

// Statements that `work` runs on this connection, those of triggers not counted.
template <class Work>
int statements_of(Database& database, Work work) {
  int statements = 0;
  const auto count = [](unsigned, void* counter, void*, void* text) {
    const auto* sql = static_cast<const char*>(text);
    if (sql[0] != '-' || sql[1] != '-') ++*static_cast<int*>(counter);
    return 0;
  };
  sqlite3* connection = database.connection().getHandle();
  sqlite3_trace_v2(connection, SQLITE_TRACE_STMT, count, &statements);
  work();
  sqlite3_trace_v2(connection, 0, nullptr, nullptr);
  return statements;
}

// Rows that it looks at because no index tells where those are that it wants.
template <class Work>
int rows_scanned_by(Database& database, Work work) {
  int rows = 0;
  const auto count = [](unsigned, void* counter, void* statement, void*) {
    *static_cast<int*>(counter) +=
        sqlite3_stmt_status(static_cast<sqlite3_stmt*>(statement), SQLITE_STMTSTATUS_FULLSCAN_STEP, 1);
    return 0;
  };
  sqlite3* connection = database.connection().getHandle();
  sqlite3_trace_v2(connection, SQLITE_TRACE_PROFILE, count, &rows);
  work();
  sqlite3_trace_v2(connection, 0, nullptr, nullptr);
  return rows;
}

// Statements that connections run which only read, of whatever thread: of those that are opened while one of these
// lives, after count() and before the next. One at a time.
class StatementsOfReaders {
 public:
  StatementsOfReaders() { sqlite3_auto_extension(reinterpret_cast<void (*)()>(watch)); }
  ~StatementsOfReaders() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(watch)); }
  StatementsOfReaders(const StatementsOfReaders&) = delete;
  StatementsOfReaders& operator=(const StatementsOfReaders&) = delete;
  // Since the last time.
  static int count() { return run().exchange(0); }

 private:
  static std::atomic<int>& run() {
    static std::atomic<int> statements = 0;
    return statements;
  }
  static int watch(sqlite3* connection, char** /*error*/, const void* /*api*/) {
    const auto note = [](unsigned, void*, void* statement, void* text) {
      const auto* sql = static_cast<const char*>(text);
      const bool of_trigger = sql[0] == '-' && sql[1] == '-';
      if (!of_trigger && sqlite3_db_readonly(sqlite3_db_handle(static_cast<sqlite3_stmt*>(statement)), "main") == 1)
        ++run();
      return 0;
    };
    return sqlite3_trace_v2(connection, SQLITE_TRACE_STMT, note, nullptr);
  }
};

}  // namespace veneer::db
