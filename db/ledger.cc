#include "db/ledger.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include "db/ledger_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

AllocationState state_of(const std::string& name) {
  for (const auto state : {AllocationState::kReserved, AllocationState::kCutting, AllocationState::kCut,
                           AllocationState::kSuspect, AllocationState::kScrap})
    if (name == to_string(state)) return state;
  return AllocationState::kReleased;  // the schema allows no seventh
}

std::string mark_of(SQLite::Database& connection, PieceId piece) {
  SQLite::Statement row(connection, "SELECT mark FROM pieces WHERE id = ?");
  row.bind(1, piece.value);
  return row.executeStep() ? text(row.getColumn(0)) : fmt::format("no. {}", piece.value);
}

// The wood that the piece itself needs must be among what it books, or its neighbours would be cut into.
bool area_holds_outline(const NewAllocation& wanted) {
  if (wanted.area.empty() || wanted.outline.size() < 3) return false;
  return subtract(Region<PanelFrame>(wanted.outline), wanted.area).area() < SquareMillimetres(1e-3);
}

Result<std::vector<AllocationRecord>> read_allocations(Database& database, const PanelId& panel, const char* which) {
  return guarded(database, [&](SQLite::Database& connection) -> Result<std::vector<AllocationRecord>> {
    SQLite::Statement rows(connection,
                           fmt::format("SELECT id, job, piece, state, outline_um, area_um, reason, changed_at FROM "
                                       "allocations WHERE panel = ? {} ORDER BY id",
                                       which));
    rows.bind(1, panel.value);
    std::vector<AllocationRecord> out;
    while (rows.executeStep()) {
      const auto outline = read_ring(text(rows.getColumn(4)));
      const auto area = read_area(text(rows.getColumn(5)));
      if (!outline || !area) throw damaged("an allocation of panel " + panel.value);
      out.push_back({{rows.getColumn(0).getInt64()},
                     panel,
                     {rows.getColumn(1).getInt64()},
                     {rows.getColumn(2).getInt64()},
                     state_of(text(rows.getColumn(3))),
                     from_micro<PanelFrame>(*outline),
                     Region<PanelFrame>(*area),
                     text(rows.getColumn(6)),
                     text(rows.getColumn(7))});
    }
    return out;
  });
}

}  // namespace

const char* to_string(AllocationState state) {
  switch (state) {
    case AllocationState::kReserved:
      return "reserved";
    case AllocationState::kCutting:
      return "cutting";
    case AllocationState::kCut:
      return "cut";
    case AllocationState::kSuspect:
      return "suspect";
    case AllocationState::kScrap:
      return "scrap";
    case AllocationState::kReleased:
      return "released";
  }
  return "released";
}

Status insert_reserved(SQLite::Database& connection, std::span<const NewAllocation> plan, const std::string& at) {
  SQLite::Statement insert(
      connection,
      "INSERT INTO allocations (panel, job, piece, state, outline_um, area_um, reason, changed_at) "
      "VALUES (?, ?, ?, 'reserved', ?, ?, '', ?)");
  for (const NewAllocation& wanted : plan) {
    if (!area_holds_outline(wanted))
      return Error{ErrorCode::kInvalidArgument, fmt::format("the wood booked for piece {} does not hold its outline",
                                                            mark_of(connection, wanted.piece))};
    insert.reset();
    SQLite::bind(insert, wanted.panel.value, wanted.job.value, wanted.piece.value, write_ring(to_micro(wanted.outline)),
                 write_area(wanted.area.micro_area()), at);
    try {
      insert.exec();
    } catch (const SQLite::Exception& thrown) {
      if (thrown.getExtendedErrorCode() != SQLITE_CONSTRAINT_TRIGGER) throw;
      return Error{ErrorCode::kConflict,
                   fmt::format("piece {} cannot have its wood on panel {} ({}): plan again with the free wood",
                               mark_of(connection, wanted.piece), wanted.panel.value, thrown.what())};
    }
  }
  return Ok();
}

bool move_piece(SQLite::Database& connection, PieceId piece, AllocationState from, AllocationState to,
                const std::string& at) {
  SQLite::Statement update(connection,
                           "UPDATE allocations SET state = ?, changed_at = ? WHERE state = ? AND id = "
                           "(SELECT max(id) FROM allocations WHERE piece = ?)");
  SQLite::bind(update, to_string(to), at, to_string(from), piece.value);
  return update.exec() == 1;
}

void move_all(SQLite::Database& connection, JobId job, AllocationState from, AllocationState to,
              const std::string& at) {
  SQLite::Statement update(connection, "UPDATE allocations SET state = ?, changed_at = ? WHERE state = ? AND job = ?");
  SQLite::bind(update, to_string(to), at, to_string(from), job.value);
  update.exec();
}

Status Ledger::reserve(std::span<const NewAllocation> plan, const std::string& at) {
  return in_transaction(*database_,
                        [&](SQLite::Database& connection) { return insert_reserved(connection, plan, at); });
}

Status Ledger::write_off(const PanelId& panel, const Region<PanelFrame>& area, const std::string& reason,
                         const std::string& at) {
  if (area.empty()) return Error{ErrorCode::kInvalidArgument, "there is no wood to write off"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(connection,
                             "INSERT INTO allocations (panel, state, outline_um, area_um, reason, changed_at) "
                             "VALUES (?, 'scrap', '[]', ?, ?, ?)");
    SQLite::bind(insert, panel.value, write_area(area.micro_area()), reason, at);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<AllocationRecord>> Ledger::live_allocations(const PanelId& panel) {
  return read_allocations(*database_, panel, "AND state <> 'released'");
}

Result<std::vector<AllocationRecord>> Ledger::all_allocations(const PanelId& panel) {
  return read_allocations(*database_, panel, "");
}

}  // namespace veneer::db
