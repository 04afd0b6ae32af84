// Steps of the ledger that other stores take inside a transaction of their own. Private to db; these throw
// SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/ledger.h"

namespace veneer::db {

AllocationState allocation_state_of(const std::string& name);

// Moves the piece's newest allocation from `from` to `to`; false when it is not in `from`.
bool move_piece(SQLite::Database& connection, PieceId piece, AllocationState from, AllocationState to,
                const std::string& at);
// As Ledger::write_off_free; how much was booked.
SquareMillimetres write_off_free(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                                 const std::string& reason, const std::string& at);
// Moves every allocation of the job that is in `from`.
void move_all(SQLite::Database& connection, JobId job, AllocationState from, AllocationState to, const std::string& at);

}  // namespace veneer::db
