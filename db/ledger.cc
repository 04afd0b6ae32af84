#include "db/ledger.h"

#include <fmt/format.h>

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

Result<std::vector<AllocationRecord>> read_allocations(Database& database, const PanelId& panel,
                                                       const std::string& which, int limit = -1) {
  return guarded(database, [&](SQLite::Database& connection) -> Result<std::vector<AllocationRecord>> {
    SQLite::Statement rows(connection,
                           fmt::format("SELECT a.id, a.job, a.piece, a.state, coalesce(l.panel_outline_um, '[]'), "
                                       "a.area_um, a.reason, a.changed_at FROM allocations AS a LEFT JOIN placements "
                                       "AS l ON l.id = a.placement WHERE a.panel = ? {} ORDER BY a.id LIMIT ?",
                                       which));
    SQLite::bind(rows, panel.value, limit);
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

Status Ledger::write_off(const PanelId& panel, const Region<PanelFrame>& area, const std::string& reason,
                         const std::string& at) {
  if (area.empty()) return Error{ErrorCode::kInvalidArgument, "there is no wood to write off"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(connection,
                             "INSERT INTO allocations (panel, state, area_um, reason, changed_at) "
                             "VALUES (?, 'scrap', ?, ?, ?)");
    SQLite::bind(insert, panel.value, write_area(area.micro_area()), reason, at);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<AllocationRecord>> Ledger::live_allocations(const PanelId& panel) {
  return read_allocations(*database_, panel, "AND a.state <> 'released'");
}

Result<std::vector<AllocationRecord>> Ledger::allocations(const PanelId& panel, AllocationId after, int limit) {
  return read_allocations(*database_, panel, fmt::format("AND a.id > {}", after.value), limit);
}

Result<std::vector<std::pair<AllocationId, AllocationState>>> Ledger::live_states(const PanelId& panel) {
  using States = std::vector<std::pair<AllocationId, AllocationState>>;
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<States> {
    SQLite::Statement rows(connection,
                           "SELECT id, state FROM allocations WHERE panel = ? AND state <> 'released' ORDER BY id");
    rows.bind(1, panel.value);
    States out;
    while (rows.executeStep())
      out.emplace_back(AllocationId{rows.getColumn(0).getInt64()}, state_of(text(rows.getColumn(1))));
    return out;
  });
}

Result<SquareMillimetres> Ledger::area_of(AllocationId allocation) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<SquareMillimetres> {
    SQLite::Statement row(connection, "SELECT area_um FROM allocations WHERE id = ?");
    row.bind(1, allocation.value);
    if (!row.executeStep())
      return Error{ErrorCode::kNotFound, fmt::format("there is no allocation {}", allocation.value)};
    const auto area = read_area(text(row.getColumn(0)));
    if (!area) throw damaged(fmt::format("allocation {}", allocation.value));
    return Region<PanelFrame>(*area).area();
  });
}

}  // namespace veneer::db
