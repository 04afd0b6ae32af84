#include "daemon/records/account_store.h"

#include <utility>

namespace veneer::daemon {
namespace {

// The schema allows no other words.
Role role_in(const std::string& word) { return role_of_name(word).value_or(Role::kViewer); }

db::UserRecord record_of(const User& user) {
  return {user.name, to_string(user.role), user.password, user.made_at, user.changed_at};
}

db::CredentialRecord record_of(const Credential& credential) {
  db::CredentialRecord out{credential.secret,
                           credential.kind == CredentialKind::kToken ? "token" : "session",
                           {},
                           credential.name,
                           to_string(credential.role),
                           credential.made_at,
                           credential.expires_at};
  if (!credential.user.empty()) out.user = credential.user;
  return out;
}

}  // namespace

void DatabaseAccountStore::add(const User& user, Then then) {
  database_.async([row = record_of(user)](Repositories& r) { return r.accounts.add(row); }, std::move(then));
}

void DatabaseAccountStore::change(const User& user, Then then) {
  database_.async([row = record_of(user)](Repositories& r) { return r.accounts.change(row); }, std::move(then));
}

void DatabaseAccountStore::remove_user(const std::string& name, Then then) {
  database_.async([name](Repositories& r) { return r.accounts.remove(name); }, std::move(then));
}

void DatabaseAccountStore::add(const Credential& credential, Then then) {
  database_.async([row = record_of(credential)](Repositories& r) { return r.accounts.add(row); }, std::move(then));
}

void DatabaseAccountStore::end(const std::vector<std::string>& secrets, Then then) {
  database_.async([secrets](Repositories& r) { return r.accounts.end(secrets); }, std::move(then));
}

namespace {

Result<StoredAccounts> accounts_of(Repositories& r) {
  const auto users = r.accounts.users();
  if (!users) return users.error();
  const auto credentials = r.accounts.credentials();
  if (!credentials) return credentials.error();
  const auto head = r.audit.head();
  if (!head) return head.error();
  StoredAccounts out;
  // The row of who signed in first may not have been written when the daemon was killed; the session was.
  out.new_cell = users->empty() && credentials->empty() && head->id == 0;
  for (const db::UserRecord& row : *users)
    out.users.push_back({row.name, role_in(row.role), row.password, row.made_at, row.changed_at});
  for (const db::CredentialRecord& row : *credentials)
    out.credentials.push_back({row.secret, row.kind == "token" ? CredentialKind::kToken : CredentialKind::kSession,
                               row.user.value_or(""), row.name, role_in(row.role), row.made_at, row.expires_at});
  return out;
}

}  // namespace

Result<StoredAccounts> stored_accounts(const DatabaseThread& database) {
  const auto reader = database.open_reader();
  if (!reader) return reader.error();
  return (*reader)->at_one_moment(accounts_of);
}

}  // namespace veneer::daemon
