#include "db/ledger.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>

#include "db/lease_sql.h"
#include "db/ledger_sql.h"
#include "db/panel_sql.h"
#include "db/shapes.h"
#include "db/sql.h"
#include "db/wood_parts.h"

namespace veneer::db {
namespace {

Result<std::vector<AllocationRecord>> read_allocations(Database& database, const PanelId& panel,
                                                       const std::string& which, int limit = -1) {
  return guarded(database, [&](SQLite::Database& connection) -> Result<std::vector<AllocationRecord>> {
    SQLite::Statement rows(connection,
                           fmt::format("SELECT a.id, a.job, a.piece, a.state, a.outline_um, a.area_um, a.reason, "
                                       "a.changed_at, e.plan, a.lead_in_um FROM allocations AS a LEFT JOIN leases AS e "
                                       "ON e.id = a.lease WHERE a.panel = ? {} ORDER BY a.id LIMIT ?",
                                       which));
    SQLite::bind(rows, panel.value, limit);
    std::vector<AllocationRecord> out;
    while (rows.executeStep()) {
      const auto outline = read_outline(text(rows.getColumn(4)));
      const auto area = read_area(text(rows.getColumn(5))), lead_in = read_area(text(rows.getColumn(9)));
      if (!outline || !area || !lead_in) throw damaged("an allocation of panel " + panel.value);
      out.push_back({{rows.getColumn(0).getInt64()},
                     panel,
                     {rows.getColumn(1).getInt64()},
                     {rows.getColumn(2).getInt64()},
                     allocation_state_of(text(rows.getColumn(3))),
                     Region<PanelFrame>(*area),
                     from_micro<PanelFrame>(*outline),
                     Region<PanelFrame>(*lead_in),
                     text(rows.getColumn(6)),
                     text(rows.getColumn(7)),
                     {rows.getColumn(8).getInt64()}});
    }
    return out;
  });
}

void enter_scrap(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                 const std::string& reason, const std::string& at) {
  SQLite::Statement insert(connection,
                           "INSERT INTO allocations (panel, state, area_um, reason, changed_at) "
                           "VALUES (?, 'scrap', ?, ?, ?)");
  SQLite::bind(insert, panel.value, write_area(area.micro_area()), reason, at);
  insert.exec();
}

}  // namespace

AllocationState allocation_state_of(const std::string& name) {
  for (const auto state : {AllocationState::kLeased, AllocationState::kReserved, AllocationState::kCutting,
                           AllocationState::kCut, AllocationState::kSuspect, AllocationState::kScrap})
    if (name == to_string(state)) return state;
  return AllocationState::kReleased;  // the schema allows no eighth
}

const char* to_string(AllocationState state) {
  switch (state) {
    case AllocationState::kLeased:
      return "leased";
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

Region<PanelFrame> kerf_of(const AllocationRecord& allocation) {
  return Region<PanelFrame>(
      kerf_of(allocation.area.micro_area(), to_micro(allocation.outline), allocation.lead_in.micro_area()));
}

bool move_piece(SQLite::Database& connection, PieceId piece, AllocationState from, AllocationState to,
                const std::string& at) {
  SQLite::Statement update(connection,
                           "UPDATE allocations SET state = ?, changed_at = ? WHERE state = ? AND id = "
                           "(SELECT max(a.id) FROM pieces AS p JOIN allocations AS a ON a.job = p.job AND a.piece = "
                           "p.id WHERE p.id = ?)");
  SQLite::bind(update, to_string(to), at, to_string(from), piece.value);
  return update.exec() == 1;
}

void move_all(SQLite::Database& connection, JobId job, AllocationState from, AllocationState to,
              const std::string& at) {
  SQLite::Statement update(connection, "UPDATE allocations SET state = ?, changed_at = ? WHERE state = ? AND job = ?");
  SQLite::bind(update, to_string(to), at, to_string(from), job.value);
  update.exec();
}

Status book(SQLite::Database& connection, SQLite::Statement& insert, const Wanted& wanted) {
  try {
    insert.exec();
    return Ok();
  } catch (const SQLite::Exception& thrown) {
    if (thrown.getExtendedErrorCode() != SQLITE_CONSTRAINT_TRIGGER) throw;
    SQLite::Statement lease(connection,
                            "SELECT e.plan, e.until FROM panels AS p JOIN allocation_boxes AS b ON b.min_panel = "
                            "p.number AND b.min_x < veneer_box(?2, 1) AND b.max_x > veneer_box(?2, 0) AND b.min_y < "
                            "veneer_box(?2, 3) AND b.max_y > veneer_box(?2, 2) JOIN allocations AS a ON a.id = b.id "
                            "JOIN leases AS e ON e.id = a.lease WHERE p.id = ?1 AND e.plan <> ?3 AND "
                            "veneer_areas_overlap(a.area_um, ?2) LIMIT 1");
    SQLite::bind(lease, wanted.panel.value, wanted.area, wanted.plan.value);
    if (lease.executeStep())
      return Error{ErrorCode::kConflict,
                   fmt::format("piece {} cannot have its wood on panel {}, which plan {} leases until {}: plan again "
                               "with the free wood, or release that with `veneerctl job release {}`",
                               wanted.mark, wanted.panel.value, lease.getColumn(0).getInt64(), text(lease.getColumn(1)),
                               lease.getColumn(0).getInt64())};
    return Error{ErrorCode::kConflict,
                 fmt::format("piece {} cannot have its wood on panel {} ({}): plan again with the free wood",
                             wanted.mark, wanted.panel.value, thrown.what())};
  }
}

SquareMillimetres write_off_free(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                                 const std::string& reason, const std::string& at) {
  // Where the two would share a slanted border, rounding to the grid lets them overlap by less than this.
  constexpr Millimetres kRounding{0.003};
  end_expired(connection, at);
  end_spoilt(connection, panel, area, at);
  SQLite::Statement rows(connection, "SELECT area_um FROM allocations WHERE panel = ? AND state <> 'released'");
  rows.bind(1, panel.value);
  std::vector<Region<PanelFrame>> booked;
  while (rows.executeStep()) {
    const auto live = read_area(text(rows.getColumn(0)));
    if (!live) throw damaged("an allocation of panel " + panel.value);
    booked.emplace_back(*live);
  }
  const auto rest = subtract(area, offset(unite(booked), kRounding, Corners::kRound));
  if (!rest.empty()) enter_scrap(connection, panel, rest, reason, at);
  return rest.area();
}

Status Ledger::write_off(const PanelId& panel, const Region<PanelFrame>& area, const std::string& reason,
                         const std::string& at) {
  if (area.empty()) return Error{ErrorCode::kInvalidArgument, "there is no wood to write off"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    end_expired(connection, at);
    enter_scrap(connection, panel, area, reason, at);
    return Ok();
  });
}

Result<SquareMillimetres> Ledger::write_off_free(const PanelId& panel, const Region<PanelFrame>& area,
                                                 const std::string& reason, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<SquareMillimetres> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    return db::write_off_free(connection, panel, area, reason, at);
  });
}

Result<std::string> Ledger::mark_of_step(std::int64_t step) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::string> {
    SQLite::Statement row(connection, "SELECT checksum FROM allocation_history WHERE id = ?");
    row.bind(1, step);
    return row.executeStep() ? text(row.getColumn(0)) : std::string();
  });
}

Result<Ledger::Changes> Ledger::changes_after(std::int64_t after) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<Changes> {
    Changes out;
    SQLite::Statement newest(connection, "SELECT id, checksum FROM allocation_history ORDER BY id DESC LIMIT 1");
    if (newest.executeStep()) out.newest = newest.getColumn(0).getInt64(), out.mark = text(newest.getColumn(1));
    if (after < 0 || after >= out.newest) return out;
    SQLite::Statement rows(connection,
                           "SELECT DISTINCT a.panel FROM allocation_history AS h JOIN allocations AS a ON a.id = "
                           "h.allocation WHERE h.id > ? AND h.id <= ?");
    SQLite::bind(rows, after, out.newest);
    while (rows.executeStep()) out.panels.push_back({text(rows.getColumn(0))});
    return out;
  });
}

Result<std::vector<AllocationRecord>> Ledger::live_allocations(const PanelId& panel) {
  return read_allocations(*database_, panel, "AND a.state <> 'released'");
}

Result<std::vector<AllocationRecord>> Ledger::allocations_at(const PanelId& panel, const Point<PanelFrame>& place) {
  const auto um = [](Millimetres length) { return std::llround(std::clamp(length.count(), -1e6, 1e6) * 1000); };
  auto near = read_allocations(
      *database_, panel,
      fmt::format("AND a.id IN (SELECT b.id FROM allocation_boxes AS b JOIN panels AS p ON b.min_panel = p.number "
                  "WHERE p.id = a.panel AND b.min_x <= {0} AND b.max_x >= {0} AND b.min_y <= {1} AND b.max_y >= {1})",
                  um(place.x), um(place.y)));
  if (near) std::erase_if(*near, [&](const AllocationRecord& a) { return !a.area.contains(place); });
  return near;
}

Result<std::optional<PieceId>> Ledger::piece_before(AllocationId carried) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<PieceId>> {
    SQLite::Statement row(connection,
                          "WITH RECURSIVE before(id) AS (SELECT origin FROM carried WHERE allocation = ? UNION SELECT "
                          "c.origin FROM carried AS c JOIN before ON c.allocation = before.id) SELECT a.piece FROM "
                          "allocations AS a JOIN before ON a.id = before.id WHERE a.piece IS NOT NULL");
    row.bind(1, carried.value);
    if (!row.executeStep()) return std::optional<PieceId>();
    return std::optional(PieceId{row.getColumn(0).getInt64()});
  });
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
      out.emplace_back(AllocationId{rows.getColumn(0).getInt64()}, allocation_state_of(text(rows.getColumn(1))));
    return out;
  });
}

Result<std::vector<WoodStep>> Ledger::steps(std::int64_t after, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<WoodStep>> {
    SQLite::Statement rows(
        connection,
        "SELECT h.id, h.allocation, a.panel, coalesce(a.job, 0), coalesce(a.piece, 0), coalesce(t.mark, ''), "
        "coalesce(l.plan, 0), h.state, a.area_um, a.reason, h.at, h.run, coalesce(f.who, '') FROM allocation_history "
        "AS h JOIN allocations AS a ON a.id = h.allocation LEFT JOIN leases AS l ON l.id = a.lease LEFT JOIN pieces AS "
        "p ON p.id = a.piece LEFT JOIN patches AS t ON t.id = p.patch LEFT JOIN run_facts AS f ON f.run = h.run WHERE "
        "h.id > ? ORDER BY h.id LIMIT ?");
    SQLite::bind(rows, after, limit);
    std::vector<WoodStep> out;
    while (rows.executeStep()) {
      WoodStep& step = out.emplace_back();
      step.number = rows.getColumn(0).getInt64();
      step.allocation = {rows.getColumn(1).getInt64()};
      step.panel = {text(rows.getColumn(2))};
      step.job = {rows.getColumn(3).getInt64()}, step.piece = {rows.getColumn(4).getInt64()};
      step.mark = text(rows.getColumn(5));
      step.leased_to = {rows.getColumn(6).getInt64()};
      step.state = allocation_state_of(text(rows.getColumn(7)));
      const auto area = read_area(text(rows.getColumn(8)));
      if (!area) throw damaged(fmt::format("allocation {}", step.allocation.value));
      step.area = Region<PanelFrame>(*area).area();
      step.reason = text(rows.getColumn(9)), step.at = text(rows.getColumn(10));
      if (!rows.getColumn(11).isNull()) step.run = rows.getColumn(11).getInt64();
      step.who = text(rows.getColumn(12));
    }
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
