#include "db/audit.h"

#include "db/sql.h"

namespace veneer::db {

Status Audit::append(const AuditEntry& entry) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(connection, "INSERT INTO audit (at, who, what, detail) VALUES (?, ?, ?, ?)");
    SQLite::bind(insert, entry.at, entry.who, entry.what, entry.detail);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<AuditEntry>> Audit::latest(int count) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<AuditEntry>> {
    SQLite::Statement rows(connection, "SELECT id, at, who, what, detail FROM audit ORDER BY id DESC LIMIT ?");
    rows.bind(1, count);
    std::vector<AuditEntry> out;
    while (rows.executeStep())
      out.push_back({rows.getColumn(0).getInt64(), text(rows.getColumn(1)), text(rows.getColumn(2)),
                     text(rows.getColumn(3)), text(rows.getColumn(4))});
    return out;
  });
}

}  // namespace veneer::db
