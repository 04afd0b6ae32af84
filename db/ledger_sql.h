// Steps of the ledger that other stores take inside a transaction of their own. Private to db; these throw
// SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/ledger.h"

namespace veneer::db {

// Moves the piece's newest allocation from `from` to `to`; false when it is not in `from`.
bool move_piece(SQLite::Database& connection, PieceId piece, AllocationState from, AllocationState to,
                const std::string& at);
// Moves every allocation of the job that is in `from`.
void move_all(SQLite::Database& connection, JobId job, AllocationState from, AllocationState to, const std::string& at);

}  // namespace veneer::db
