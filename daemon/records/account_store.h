// Accounts in the cell's database.
#pragma once

#include "daemon/api/accounts.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class DatabaseAccountStore final : public AccountStore {
 public:
  // `database` outlives this.
  explicit DatabaseAccountStore(DatabaseThread& database) : database_(database) {}

  void add(const User& user, Then then) override;
  void change(const User& user, Then then) override;
  void remove_user(const std::string& name, Then then) override;
  void add(const Credential& credential, Then then) override;
  void end(const std::vector<std::string>& secrets, Then then) override;

 private:
  DatabaseThread& database_;
};

struct StoredAccounts {
  std::vector<User> users;
  std::vector<Credential> credentials;
  bool new_cell = false;  // nobody has ever done anything here
};
// Before the reactor runs, on a connection that only reads: a database that is being checked does not keep anybody out.
Result<StoredAccounts> stored_accounts(const DatabaseThread& database);

}  // namespace veneer::daemon
