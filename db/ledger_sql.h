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
// As JobStore::book_piece.
Status book_cut(SQLite::Database& connection, PieceId piece, const std::string& at);
// Wood that a piece of a plan is to have.
struct Wanted {
  std::string mark;
  PanelId panel;
  std::string area;  // as it is stored
  PlanId plan;
};
// `insert` books it: kConflict where the schema refuses that, with whoever leases the wood.
Status book(SQLite::Database& connection, SQLite::Statement& insert, const Wanted& wanted);
// As Ledger::write_off_free, once leases of wood in `area` have ended: it is gone; how much was booked.
SquareMillimetres write_off_free(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                                 const std::string& reason, const std::string& at);
// Moves every allocation of the job that is in `from`.
void move_all(SQLite::Database& connection, JobId job, AllocationState from, AllocationState to, const std::string& at);

}  // namespace veneer::db
