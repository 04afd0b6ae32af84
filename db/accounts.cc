#include "db/accounts.h"

#include <fmt/format.h>

#include "db/sql.h"

namespace veneer::db {
namespace {

Error no_user(const std::string& name) {
  return Error{ErrorCode::kNotFound, fmt::format("there is no user {}: see `veneerctl user list`", name)};
}

bool is_user(SQLite::Database& connection, const std::string& name) {
  SQLite::Statement row(connection, "SELECT 1 FROM users WHERE name = ?");
  row.bind(1, name);
  return row.executeStep();
}

bool has_token(SQLite::Database& connection, const std::string& user, const std::string& name) {
  SQLite::Statement row(connection, "SELECT 1 FROM credentials WHERE user = ? AND name = ? AND kind = 'token'");
  SQLite::bind(row, user, name);
  return row.executeStep();
}

}  // namespace

Result<std::vector<UserRecord>> Accounts::users() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<std::vector<UserRecord>> {
    SQLite::Statement rows(connection, "SELECT name, role, password, made_at, changed_at FROM users ORDER BY name");
    std::vector<UserRecord> out;
    while (rows.executeStep())
      out.push_back({text(rows.getColumn(0)), text(rows.getColumn(1)), text(rows.getColumn(2)), text(rows.getColumn(3)),
                     text(rows.getColumn(4))});
    return out;
  });
}

Status Accounts::add(const UserRecord& user) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (is_user(connection, user.name))
      return Error{ErrorCode::kConflict,
                   fmt::format("there is a user {} already: take another name, or change that one", user.name)};
    SQLite::Statement insert(connection,
                             "INSERT INTO users (name, role, password, made_at, changed_at) VALUES (?, ?, ?, ?, ?)");
    SQLite::bind(insert, user.name, user.role, user.password, user.made_at, user.changed_at);
    insert.exec();
    return Ok();
  });
}

Status Accounts::change(const UserRecord& user) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement update(connection, "UPDATE users SET role = ?, password = ?, changed_at = ? WHERE name = ?");
    SQLite::bind(update, user.role, user.password, user.changed_at, user.name);
    if (update.exec() == 0) return no_user(user.name);
    SQLite::Statement sessions(connection, "DELETE FROM credentials WHERE user = ? AND kind = 'session'");
    sessions.bind(1, user.name);
    sessions.exec();
    return Ok();
  });
}

Status Accounts::remove(const std::string& name) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement signed_in(connection, "DELETE FROM credentials WHERE user = ?");
    signed_in.bind(1, name);
    signed_in.exec();
    SQLite::Statement user(connection, "DELETE FROM users WHERE name = ?");
    user.bind(1, name);
    return user.exec() == 0 ? Status(no_user(name)) : Ok();
  });
}

Result<std::vector<CredentialRecord>> Accounts::credentials() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<std::vector<CredentialRecord>> {
    SQLite::Statement rows(connection,
                           "SELECT secret, kind, user, name, role, made_at, expires_at FROM credentials ORDER BY id");
    std::vector<CredentialRecord> out;
    while (rows.executeStep())
      out.push_back({text(rows.getColumn(0)), text(rows.getColumn(1)), text_or_null(rows.getColumn(2)),
                     text(rows.getColumn(3)), text(rows.getColumn(4)), text(rows.getColumn(5)),
                     text(rows.getColumn(6))});
    return out;
  });
}

Status Accounts::add(const CredentialRecord& credential) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (credential.user && !is_user(connection, *credential.user)) return no_user(*credential.user);
    if (credential.user && credential.kind == "token" && has_token(connection, *credential.user, credential.name))
      return Error{ErrorCode::kConflict, fmt::format("{} has a token {} already: revoke it, or take another name",
                                                     *credential.user, credential.name)};
    SQLite::Statement insert(connection,
                             "INSERT INTO credentials (secret, kind, name, role, made_at, expires_at, user) VALUES "
                             "(?, ?, ?, ?, ?, ?, ?)");
    SQLite::bind(insert, credential.secret, credential.kind, credential.name, credential.role, credential.made_at,
                 credential.expires_at);
    if (credential.user) insert.bind(7, *credential.user);
    insert.exec();
    return Ok();
  });
}

Status Accounts::end(const std::vector<std::string>& secrets) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement remove(connection, "DELETE FROM credentials WHERE secret = ?");
    for (const std::string& secret : secrets) {
      remove.reset();
      remove.bind(1, secret);
      remove.exec();
    }
    return Ok();
  });
}

Status Accounts::end_all() {
  return in_transaction(*database_, [](SQLite::Database& connection) -> Status {
    connection.exec("DELETE FROM credentials");
    return Ok();
  });
}

}  // namespace veneer::db
