// What makes the audit log tell of its own changes: each row carries a hash of the row before it and of its own
// columns, so that a row that was changed, removed, added or moved in the middle no longer follows from the one before.
// Whoever rewrites all rows from one on is found by the head alone, if somebody wrote that down elsewhere.
//
// hash = SHA-256, in lower-case hex, over the netstrings ("5:local,") of: the hash of the row before ("" for the
// first), id in decimal, at, who, what, detail. Private to db; these throw SQLite::Exception.
#pragma once

#include <string>

#include "base/result.h"
#include "db/audit.h"

namespace SQLite {
class Database;
class Statement;
}  // namespace SQLite

namespace veneer::db {

// SQL function veneer_audit_hash(hash of the row before, id, at, who, what, detail).
void register_audit_hash(SQLite::Database& connection);

// A row of these columns.
inline constexpr const char* kAuditColumns = "id, at, who, what, detail, hash";
AuditEntry read_audit(SQLite::Statement& row);

// The one place where rows enter; inside a transaction that writes. The entry's id and hash are not looked at. Refuses
// when the last rows are missing (SQLITE_CORRUPT).
void append_to_chain(SQLite::Database& connection, const AuditEntry& entry);

// {0, ""} of a log without rows.
AuditHead head_of_chain(SQLite::Database& connection);

// Every row follows from the one before, and none is missing at the end. kStorage names the first that does not.
Status check_chain(SQLite::Database& connection, const std::string& file);

}  // namespace veneer::db
