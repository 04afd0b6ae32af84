#include "db/audit.h"

#include <fmt/format.h>

#include "db/audit_chain.h"
#include "db/sql.h"

namespace veneer::db {

namespace {

constexpr int kFirstWord = 10;  // of the statement's parameters

}  // namespace

Status Audit::append(const AuditEntry& entry) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    append_to_chain(connection, entry);
    return Ok();
  });
}

Result<std::vector<AuditEntry>> Audit::read(const AuditFilter& filter, int count) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<AuditEntry>> {
    std::string wanted = "id < ?1";
    if (!filter.since.empty()) wanted += " AND at >= ?2";
    if (!filter.until.empty()) wanted += " AND at < ?7";
    if (!filter.who.empty()) wanted += " AND who = ?3";
    if (!filter.what.empty()) wanted += " AND what = ?6";
    if (!filter.kind.empty()) wanted += " AND substr(what, 1, length(?8) + 1) = ?8 || '.'";
    // "run 3 of job 12 on P-0001", "POST /api/v1/jobs/12/start"; job.start has its number alone.
    if (filter.job)
      wanted +=
          " AND (detail || ' ' GLOB '*job ' || ?9 || '[^0-9]*' OR detail || ' ' GLOB '*/jobs/' || ?9 || '[^0-9]*'"
          " OR (what = 'job.start' AND detail = ?9))";
    for (std::size_t i = 0; i < filter.words.size(); ++i)
      wanted += fmt::format(" AND instr(lower(at || ' ' || who || ' ' || what || ' ' || detail), lower(?{})) > 0",
                            kFirstWord + static_cast<int>(i));
    // P-1000 is not named where P-10000 is.
    if (filter.panel) wanted += " AND (detail GLOB '*' || ?4 || '[^0-9]*' OR detail GLOB '*' || ?4)";
    SQLite::Statement rows(connection, std::string("SELECT ") + kAuditColumns + " FROM audit WHERE " + wanted +
                                           " ORDER BY id DESC LIMIT ?5");
    rows.bind(1, filter.before.value_or(INT64_MAX));
    if (!filter.since.empty()) rows.bind(2, filter.since);
    if (!filter.who.empty()) rows.bind(3, filter.who);
    if (filter.panel) rows.bind(4, filter.panel->value);
    rows.bind(5, count);
    if (!filter.what.empty()) rows.bind(6, filter.what);
    if (!filter.until.empty()) rows.bind(7, filter.until);
    if (!filter.kind.empty()) rows.bind(8, filter.kind);
    if (filter.job) rows.bind(9, std::to_string(filter.job->value));
    for (std::size_t i = 0; i < filter.words.size(); ++i) rows.bind(kFirstWord + static_cast<int>(i), filter.words[i]);
    std::vector<AuditEntry> out;
    while (rows.executeStep()) out.push_back(read_audit(rows));
    return out;
  });
}

Result<bool> Audit::devices_were_chosen() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<bool> {
    // The last condition is the index's own, word for word, or SQLite does not see that the index suffices.
    SQLite::Statement row(connection,
                          fmt::format("SELECT coalesce(sum(CASE what WHEN '{0}' THEN 1 ELSE -1 END), 0) > 0 FROM audit "
                                      "WHERE what IN ('{0}', '{1}')",
                                      kDeviceChosen, kDeviceNotChosen));
    row.executeStep();
    return row.getColumn(0).getInt() != 0;
  });
}

Result<AuditHead> Audit::head() {
  return guarded(*database_,
                 [](SQLite::Database& connection) -> Result<AuditHead> { return head_of_chain(connection); });
}

}  // namespace veneer::db
