// Accounts: users, and the sessions and tokens by which somebody is signed in. Passwords come here as argon2id strings,
// secrets as SHA-256: what would open a door is not in the file.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

struct UserRecord {
  std::string name;
  std::string role;      // viewer | operator | maintainer | admin
  std::string password;  // "$argon2id$..."
  std::string made_at, changed_at;
};

struct CredentialRecord {
  std::string secret;               // its SHA-256 in lower-case hex
  std::string kind;                 // session | token
  std::optional<std::string> user;  // nothing: of a console link
  std::string name;                 // of a token what it is for, of a console link which one
  std::string role;
  std::string made_at, expires_at;
};

class Accounts {
 public:
  explicit Accounts(Database& database) : database_(&database) {}

  Result<std::vector<UserRecord>> users();  // by name
  // kConflict when there is one of this name.
  Status add(const UserRecord& user);
  // Role and password anew; the user's sessions end, tokens stay. kNotFound.
  Status change(const UserRecord& user);
  // With all that is signed in as this user. kNotFound.
  Status remove(const std::string& name);

  Result<std::vector<CredentialRecord>> credentials();  // oldest first
  // kNotFound without its user, kConflict when the user has a token of this name.
  Status add(const CredentialRecord& credential);
  // Those that are there.
  Status end(const std::vector<std::string>& secrets);
  // All of them: after a backup took the place of the database, when some may have been ended since.
  Status end_all();

 private:
  Database* database_;
};

}  // namespace veneer::db
