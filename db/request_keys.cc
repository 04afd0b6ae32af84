#include "db/request_keys.h"

#include <fmt/format.h>

#include "db/request_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kOfKey = " WHERE who = ? AND operation = ? AND key = ?";

}  // namespace

Status write_result(SQLite::Database& connection, const KeyedRequest& request, const std::string& result) {
  SQLite::Statement update(connection,
                           "UPDATE request_keys SET result = ? WHERE who = ? AND operation = ? AND key = ? AND "
                           "result IS NULL");
  SQLite::bind(update, result, request.who, request.operation, request.key);
  if (update.exec() == 1) return Ok();
  return Error{ErrorCode::kConflict, fmt::format("the request under the key {} was done already", request.key)};
}

Result<std::optional<KeyedOutcome>> RequestKeys::begin(const KeyedRequest& request, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<std::optional<KeyedOutcome>> {
    SQLite::Statement known(connection, std::string("SELECT request_hash, result FROM request_keys") + kOfKey);
    SQLite::bind(known, request.who, request.operation, request.key);
    if (known.executeStep()) {
      if (text(known.getColumn(0)) != request.request_hash)
        return Error{ErrorCode::kConflict,
                     fmt::format("the key {} was used for another request: use a new one", request.key)};
      return std::optional(KeyedOutcome{text_or_null(known.getColumn(1))});
    }
    SQLite::Statement insert(connection,
                             "INSERT INTO request_keys (who, operation, key, request_hash, at) VALUES (?, ?, ?, ?, ?)");
    SQLite::bind(insert, request.who, request.operation, request.key, request.request_hash, at);
    insert.exec();
    return std::optional<KeyedOutcome>();
  });
}

Status RequestKeys::forget(const KeyedRequest& request) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement remove(connection, std::string("DELETE FROM request_keys") + kOfKey + " AND result IS NULL");
    SQLite::bind(remove, request.who, request.operation, request.key);
    remove.exec();
    return Ok();
  });
}

Result<int> RequestKeys::prune(const std::string& before) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<int> {
    SQLite::Statement remove(connection, "DELETE FROM request_keys WHERE at < ?");
    remove.bind(1, before);
    return remove.exec();
  });
}

}  // namespace veneer::db
