#include "db/events.h"

#include "db/sql.h"

namespace veneer::db {

EventPlace place_of(const EventRecord& event) {
  return {event.at, event.kind, event.part, event.step, event.panel ? event.panel->value : ""};
}

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
    const bool goes_on = !after.at.empty() && after.at >= filter.since;
    if (goes_on) wanted += " AND (at, kind, part, step, coalesce(panel, '')) > (?1, ?2, ?3, ?4, ?5)";
    if (!filter.until.empty()) wanted += " AND at < ?6";
    if (filter.panel) wanted += " AND panel = ?7";
    if (job) wanted += " AND job = ?8";
    if (filter.piece) wanted += " AND piece = ?9";
    if (!filter.kind.empty()) wanted += " AND kind = ?10";
    SQLite::Statement rows(
        connection, "SELECT at, step, kind, part, panel, job, piece, run, what, who FROM events WHERE " + wanted +
                        " ORDER BY at, kind, part, step, panel LIMIT ?11");
    rows.bind(1, goes_on ? after.at : filter.since);
    if (goes_on)
      rows.bind(2, after.kind), rows.bind(3, after.part), rows.bind(4, after.step), rows.bind(5, after.panel);
    if (!filter.until.empty()) rows.bind(6, filter.until);
    if (filter.panel) rows.bind(7, filter.panel->value);
    if (job) rows.bind(8, job->value);
    if (filter.piece) rows.bind(9, filter.piece->value);
    if (!filter.kind.empty()) rows.bind(10, filter.kind);
    rows.bind(11, limit);
    std::vector<EventRecord> out;
    while (rows.executeStep()) {
      EventRecord& event = out.emplace_back();
      event.at = text(rows.getColumn(0)), event.step = rows.getColumn(1).getInt64();
      event.kind = text(rows.getColumn(2)), event.part = rows.getColumn(3).getInt();
      if (!rows.getColumn(4).isNull()) event.panel = PanelId{text(rows.getColumn(4))};
      if (!rows.getColumn(5).isNull()) event.job = JobId{rows.getColumn(5).getInt64()};
      if (!rows.getColumn(6).isNull()) event.piece = PieceId{rows.getColumn(6).getInt64()};
      if (!rows.getColumn(7).isNull()) event.run = rows.getColumn(7).getInt64();
      event.what = text(rows.getColumn(8)), event.who = text(rows.getColumn(9));
    }
    return out;
  });
}

}  // namespace veneer::db
