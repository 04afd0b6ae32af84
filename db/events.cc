#include "db/events.h"

#include <algorithm>

#include "db/sql.h"

namespace veneer::db {

Result<std::vector<EventRecord>> Events::read(const EventFilter& filter, const EventPlace& after, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<EventRecord>> {
    std::optional<JobId> job = filter.job;
    if (filter.piece) {
      // An index knows wood by its job: by the piece alone all of it would be looked at.
      SQLite::Statement of(connection, "SELECT job FROM pieces WHERE id = ?");
      of.bind(1, filter.piece->value);
      if (!of.executeStep()) return std::vector<EventRecord>();
      if (job && job->value != of.getColumn(0).getInt64()) return std::vector<EventRecord>();
      job = JobId{of.getColumn(0).getInt64()};
    }
    std::string wanted = "at >= ?1";
    if (!filter.until.empty()) wanted += " AND at < ?2";
    if (filter.panel) wanted += " AND panel = ?3";
    if (job) wanted += " AND job = ?4";
    if (!filter.kind.empty()) wanted += " AND kind = ?8";
    if (filter.piece) wanted += " AND piece = ?5";
    SQLite::Statement rows(connection, "SELECT at, step, kind, panel, job, piece, run, what, who FROM events WHERE " +
                                           wanted + " ORDER BY at, kind, step, what, panel LIMIT ?6 OFFSET ?7");
    // Those that were told of the instant come first of what is not before it.
    rows.bind(1, std::max(filter.since, after.at));
    if (!filter.until.empty()) rows.bind(2, filter.until);
    if (filter.panel) rows.bind(3, filter.panel->value);
    if (job) rows.bind(4, job->value);
    if (filter.piece) rows.bind(5, filter.piece->value);
    if (!filter.kind.empty()) rows.bind(8, filter.kind);
    rows.bind(6, limit);
    rows.bind(7, after.at >= filter.since ? after.told : 0);
    std::vector<EventRecord> out;
    while (rows.executeStep()) {
      EventRecord& event = out.emplace_back();
      event.at = text(rows.getColumn(0)), event.step = rows.getColumn(1).getInt64();
      event.kind = text(rows.getColumn(2));
      if (!rows.getColumn(3).isNull()) event.panel = PanelId{text(rows.getColumn(3))};
      if (!rows.getColumn(4).isNull()) event.job = JobId{rows.getColumn(4).getInt64()};
      if (!rows.getColumn(5).isNull()) event.piece = PieceId{rows.getColumn(5).getInt64()};
      if (!rows.getColumn(6).isNull()) event.run = rows.getColumn(6).getInt64();
      event.what = text(rows.getColumn(7)), event.who = text(rows.getColumn(8));
    }
    return out;
  });
}

}  // namespace veneer::db
