// What the cell is doing, by the newest row of `activities`; what broke it off, and whether a person has cleared that,
// by the newest row of `aborts`.
#include "db/audit_chain.h"
#include "db/job_sql.h"
#include "db/job_store.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

void note(SQLite::Database& connection, bool cleared, const std::string& who, const std::string& reason,
          const std::string& at) {
  SQLite::Statement insert(connection, "INSERT INTO aborts (cleared, who, reason, at) VALUES (?, ?, ?, ?)");
  SQLite::bind(insert, cleared ? 1 : 0, who, reason, at);
  insert.exec();
}

}  // namespace

void note_activity(SQLite::Database& connection, bool under_way, const std::string& doing, const std::string& at) {
  SQLite::Statement insert(connection, "INSERT INTO activities (under_way, doing, at) VALUES (?, ?, ?)");
  SQLite::bind(insert, under_way ? 1 : 0, doing, at);
  insert.exec();
}

void note_broken_off(SQLite::Database& connection, const std::string& reason, const std::string& at,
                     const std::string& who) {
  note(connection, false, who.empty() ? std::string(kDaemon) : who, reason, at);
  note_rest(connection, at);
}

std::optional<std::string> clear_owed(SQLite::Database& connection) {
  SQLite::Statement newest(connection, "SELECT cleared, reason FROM aborts ORDER BY id DESC LIMIT 1");
  if (!newest.executeStep() || newest.getColumn(0).getInt() != 0) return std::nullopt;
  return text(newest.getColumn(1));
}

std::optional<std::string> under_way(SQLite::Database& connection) {
  SQLite::Statement newest(connection, "SELECT under_way, doing FROM activities ORDER BY id DESC LIMIT 1");
  if (!newest.executeStep() || newest.getColumn(0).getInt() == 0) return std::nullopt;
  return text(newest.getColumn(1));
}

void note_rest(SQLite::Database& connection, const std::string& at) {
  if (under_way(connection)) note_activity(connection, false, "", at);
}

Status JobStore::note_under_way(const std::string& doing, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    note_activity(connection, true, doing, at);
    return Ok();
  });
}

Status JobStore::note_at_rest(const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    note_rest(connection, at);
    return Ok();
  });
}

Status JobStore::note_abort(const std::string& reason, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    note_broken_off(connection, reason, at, who);
    return Ok();
  });
}

Status JobStore::note_cleared(const std::string& who, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (clear_owed(connection)) note(connection, true, who, "", at);
    return Ok();
  });
}

}  // namespace veneer::db
