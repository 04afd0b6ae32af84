// Whether the log beside a database can be emptied.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "daemon/store/database_thread.h"

namespace veneer::testing {

// Whether all that is written by now gets from the log into the file: nobody holds a moment of before. A question that
// is over within a moment may be in its way once, so it is tried again.
inline bool checkpoint_completes(daemon::DatabaseThread& database) {
  constexpr int kTries = 1000;
  const auto tried = [](daemon::Repositories& r) {
    SQLite::Statement checkpoint(r.connection.connection(), "PRAGMA wal_checkpoint(PASSIVE)");
    return checkpoint.executeStep() && checkpoint.getColumn(0).getInt() == 0 &&
           checkpoint.getColumn(1).getInt() == checkpoint.getColumn(2).getInt();
  };
  const Status written = database.call([](daemon::Repositories& r) {
    return r.audit.append({0, "2026-05-01T07:30:00.000Z", "uid 1000", "test", ""});
  });
  for (int i = 0; written && i < kTries; ++i)
    if (database.call(tried)) return true;
  return false;
}

}  // namespace veneer::testing
