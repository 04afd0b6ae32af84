// How a panel leaves the stock, retired or sawn apart, and comes back.
#include <fmt/format.h>

#include <string_view>

#include "db/done_by_sql.h"
#include "db/lease_sql.h"
#include "db/panel_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

void insert_retirement(SQLite::Database& connection, const PanelId& panel, bool retired, const std::string& reason,
                       const std::string& at) {
  SQLite::Statement insert(connection, "INSERT INTO retirements (panel, retired, reason, at) VALUES (?, ?, ?, ?)");
  SQLite::bind(insert, panel.value, retired ? 1 : 0, reason, at);
  insert.exec();
}

}  // namespace

Status leave_stock(SQLite::Database& connection, const PanelId& panel, const std::string& reason,
                   const std::string& at) {
  if (!panel_exists(connection, panel)) return no_such_panel(panel);
  if (is_retired(connection, panel))
    return Error{ErrorCode::kConflict, fmt::format("panel {} is retired already", panel.value)};
  end_expired(connection, at);
  SQLite::Statement leased(connection,
                           "SELECT e.plan, e.until FROM allocations AS a JOIN leases AS e ON e.id = a.lease WHERE "
                           "a.panel = ? AND a.state = 'leased' ORDER BY e.id LIMIT 1");
  leased.bind(1, panel.value);
  if (leased.executeStep())
    return Error{ErrorCode::kConflict,
                 fmt::format("plan {0} leases wood of panel {1} until {2}: release it first with `veneerctl job "
                             "release {0}`",
                             leased.getColumn(0).getInt64(), panel.value, text(leased.getColumn(1)))};
  SQLite::Statement open(connection,
                         "SELECT job, state, count(*) FROM allocations WHERE panel = ? AND state IN ('reserved', "
                         "'cutting', 'suspect') GROUP BY job, state ORDER BY job, state LIMIT 1");
  open.bind(1, panel.value);
  if (open.executeStep()) {
    const int count = open.getColumn(2).getInt();
    const bool one = count == 1;
    const std::string_view what = text(open.getColumn(1)) == "suspect"
                                      ? (one ? "suspect piece" : "suspect pieces")
                                      : (one ? "piece that is not cut yet" : "pieces that are not cut yet");
    const std::string_view remedy = text(open.getColumn(1)) == "suspect"
                                        ? (one ? "settle what became of it" : "settle what became of them")
                                        : (one ? "cut it, or cancel the job," : "cut them, or cancel the job,");
    return Error{ErrorCode::kConflict, fmt::format("panel {} holds {} {} of job {}: {} first", panel.value, count, what,
                                                   open.getColumn(0).getInt64(), remedy)};
  }
  insert_retirement(connection, panel, true, reason, at);
  return Ok();
}

std::optional<std::string> booked_under(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement cut(
      connection,
      "WITH RECURSIVE older (id) AS (SELECT parent FROM panels WHERE id = ?1 UNION SELECT p.parent FROM panels AS p "
      "JOIN older AS o ON p.id = o.id) SELECT f.panel FROM fiducials AS mine JOIN fiducials AS f ON f.kind = 'tag' AND "
      "f.number = mine.number AND f.panel <> mine.panel JOIN allocations AS a ON a.panel = f.panel AND a.state <> "
      "'released' LEFT JOIN carried AS c ON c.allocation = a.id WHERE mine.panel = ?1 AND mine.kind = 'tag' AND "
      "c.allocation IS NULL AND f.panel NOT IN (SELECT id FROM older WHERE id IS NOT NULL) LIMIT 1");
  cut.bind(1, panel.value);
  if (!cut.executeStep()) return std::nullopt;
  return text(cut.getColumn(0));
}

Status Panels::retire(const PanelId& panel, const std::string& reason, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status left = leave_stock(connection, panel, reason, at); !left.ok()) return left;
    note_done_by(connection, Done::kPanelRetired, connection.getLastInsertRowid(), who);
    return Ok();
  });
}

Status Panels::split(const PanelId& panel, const std::string& who, const std::string& reason, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement run(connection, "SELECT job FROM runs WHERE panel = ? AND ended_at IS NULL");
    run.bind(1, panel.value);
    if (run.executeStep())
      return Error{ErrorCode::kConflict, fmt::format("job {} is being cut from panel {}: wait until the run is over",
                                                     run.getColumn(0).getInt64(), panel.value)};
    if (Status left = leave_stock(connection, panel, reason, at); !left.ok()) return left;
    SQLite::Statement insert(connection, "INSERT INTO splits (retirement, who) VALUES (?, ?)");
    SQLite::bind(insert, connection.getLastInsertRowid(), who);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<PanelId>> Panels::sawn() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<std::vector<PanelId>> {
    SQLite::Statement rows(connection,
                           "SELECT r.panel FROM splits AS s JOIN retirements AS r ON r.id = s.retirement WHERE r.id = "
                           "(SELECT max(id) FROM retirements WHERE panel = r.panel) ORDER BY r.id DESC");
    std::vector<PanelId> out;
    while (rows.executeStep()) out.push_back({text(rows.getColumn(0))});
    return out;
  });
}

Status Panels::restore(const PanelId& panel, const std::string& reason, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    if (!is_retired(connection, panel))
      return Error{ErrorCode::kConflict, fmt::format("panel {} is in stock", panel.value)};
    if (const auto one = db::merged_into(connection, panel))
      return Error{ErrorCode::kConflict,
                   fmt::format("panel {} is panel {}, which holds its wood: use that one", panel.value, one->value)};
    SQLite::Statement part(
        connection, "SELECT t.panel FROM parts AS t JOIN panels AS p ON p.id = t.panel WHERE p.parent = ? LIMIT 1");
    part.bind(1, panel.value);
    if (part.executeStep())
      return Error{ErrorCode::kConflict,
                   fmt::format("panel {} was sawn apart, and its wood is that of its parts, as of panel {}: use those",
                               panel.value, text(part.getColumn(0)))};
    SQLite::Statement other(
        connection, fmt::format("SELECT p.id, f.number FROM fiducials AS mine JOIN fiducials AS f ON f.kind = "
                                "'tag' AND f.number = mine.number AND f.panel <> mine.panel JOIN panels AS p ON "
                                "p.id = f.panel WHERE mine.panel = ? AND mine.kind = 'tag' AND {} LIMIT 1",
                                kIsInStock));
    other.bind(1, panel.value);
    if (other.executeStep())
      return Error{ErrorCode::kConflict,
                   fmt::format("panel {} carries tag {} of panel {} and is in stock: retire it first",
                               text(other.getColumn(0)), other.getColumn(1).getInt(), panel.value)};
    // The same sheet under another name: what was cut from it there is free in no ledger of this one.
    if (const auto cut = booked_under(connection, panel))
      return Error{
          ErrorCode::kConflict,
          fmt::format("wood of this sheet was booked under panel {}, which panel {} knows nothing of: restore {} "
                      "instead, or scan the sheet anew",
                      *cut, panel.value, *cut)};
    insert_retirement(connection, panel, false, reason, at);
    note_done_by(connection, Done::kPanelRetired, connection.getLastInsertRowid(), who);
    return Ok();
  });
}

}  // namespace veneer::db
