// Whether the log beside a database can be emptied.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "db/database.h"

namespace veneer::db {

// Whether all that is in the log gets into the file now: nobody holds a moment of before.
inline bool checkpoint_is_whole(Database& database) {
  SQLite::Statement checkpoint(database.connection(), "PRAGMA wal_checkpoint(PASSIVE)");
  return checkpoint.executeStep() && checkpoint.getColumn(0).getInt() == 0 &&
         checkpoint.getColumn(1).getInt() == checkpoint.getColumn(2).getInt();
}

}  // namespace veneer::db
