#include "db/audit_chain.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <span>

#include "base/hash.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

void add_netstring(std::string& out, std::string_view part) { out += fmt::format("{}:{},", part.size(), part); }

std::string hash_of(std::string_view before, const AuditEntry& row) {
  std::string all;
  add_netstring(all, before);
  add_netstring(all, std::to_string(row.id));
  for (const std::string* part : {&row.at, &row.who, &row.what, &row.detail}) add_netstring(all, *part);
  return sha256_hex(std::as_bytes(std::span(all)));
}

std::string text_of(sqlite3_value* value) {
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(value));
  return bytes == nullptr ? std::string() : std::string(bytes, static_cast<std::size_t>(sqlite3_value_bytes(value)));
}

void hash_function(sqlite3_context* context, int, sqlite3_value** values) {
  AuditEntry row;
  row.id = sqlite3_value_int64(values[1]);
  row.at = text_of(values[2]), row.who = text_of(values[3]), row.what = text_of(values[4]);
  row.detail = text_of(values[5]);
  const std::string hash = hash_of(text_of(values[0]), row);
  sqlite3_result_text(context, hash.data(), static_cast<int>(hash.size()), SQLITE_TRANSIENT);
}

// SQLite keeps the last number that it gave, in a table of its own.
std::string rows_missing_after(SQLite::Database& connection, const AuditHead& head) {
  SQLite::Statement entered(connection, "SELECT seq FROM sqlite_sequence WHERE name = 'audit'");
  const std::int64_t last = entered.executeStep() ? entered.getColumn(0).getInt64() : 0;
  if (last == head.id) return "";
  return fmt::format("audit row {} is the last, but row {} was written", head.id, last);
}

}  // namespace

void register_audit_hash(SQLite::Database& connection) {
  connection.createFunction("veneer_audit_hash", 6, true, nullptr, &without_exceptions<hash_function>);
}

AuditEntry read_audit(SQLite::Statement& row) {
  return {row.getColumn(0).getInt64(), text(row.getColumn(1)), text(row.getColumn(2)),
          text(row.getColumn(3)),      text(row.getColumn(4)), text(row.getColumn(5))};
}

void append_to_chain(SQLite::Database& connection, const AuditEntry& entry) {
  const AuditHead head = head_of_chain(connection);
  // Else the next check would take the new row for the one that is missing.
  if (const std::string missing = rows_missing_after(connection, head); !missing.empty())
    throw SQLite::Exception(missing, SQLITE_CORRUPT);
  AuditEntry row = entry;
  row.id = head.id + 1;
  row.hash = hash_of(head.hash, row);
  SQLite::Statement insert(connection,
                           std::string("INSERT INTO audit (") + kAuditColumns + ") VALUES (?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, row.id, row.at, row.who, row.what, row.detail, row.hash);
  insert.exec();
}

AuditHead head_of_chain(SQLite::Database& connection) {
  SQLite::Statement last(connection, "SELECT id, hash FROM audit ORDER BY id DESC LIMIT 1");
  if (!last.executeStep()) return {};
  return {last.getColumn(0).getInt64(), text(last.getColumn(1))};
}

Status check_chain(SQLite::Database& connection, const std::string& file) {
  SQLite::Statement rows(connection, std::string("SELECT ") + kAuditColumns + " FROM audit ORDER BY id");
  AuditHead before;
  while (rows.executeStep()) {
    AuditEntry row = read_audit(rows);
    if (hash_of(before.hash, row) != row.hash)
      return is_damaged(file, before.id == 0
                                  ? fmt::format("audit row {} does not begin the audit log", row.id)
                                  : fmt::format("audit row {} does not follow from row {}", row.id, before.id));
    before = {row.id, std::move(row.hash)};
  }
  if (const std::string missing = rows_missing_after(connection, before); !missing.empty())
    return is_damaged(file, missing);
  return Ok();
}

}  // namespace veneer::db
