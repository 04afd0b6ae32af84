// Who may sign in, and who is signed in: users with their roles, and the sessions and tokens of them and of console
// links. Kept in memory, so that every request is judged on the reactor without waiting; the store beside it outlives
// the daemon.
//
// What ends or lowers anything holds at once, and stays when the store cannot write it (then it says so); what gives
// somebody more waits for the store, except a session: whoever has the password comes in on a damaged disk too.
// Secrets are 256 random bits and kept as SHA-256, passwords as argon2id strings (passwords.h).
//
// Bound to the reactor.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

struct User {
  std::string name;
  Role role = Role::kViewer;
  std::string password;  // "$argon2id$..."
  std::string made_at, changed_at;
};

enum class CredentialKind { kSession, kToken };

struct Credential {
  std::string secret;  // its SHA-256 in lower-case hex
  CredentialKind kind = CredentialKind::kSession;
  std::string user;  // "": of a console link
  std::string name;  // of a token what it is for, of a console link "console link 3 of uid 1000"
  Role role = Role::kViewer;
  std::string made_at, expires_at;
};

// What outlives the daemon. Each calls `then` once, on the reactor, in the order of the calls.
class AccountStore {
 public:
  using Then = std::function<void(const Status&)>;
  virtual ~AccountStore() = default;
  virtual void add(const User& user, Then then) = 0;
  virtual void change(const User& user, Then then) = 0;  // ends the user's sessions
  virtual void remove_user(const std::string& name, Then then) = 0;
  virtual void add(const Credential& credential, Then then) = 0;
  virtual void end(const std::vector<std::string>& secrets, Then then) = 0;
};

// Of a change: what the store said, and whether it holds now.
struct Outcome : Status {
  Outcome(Status stored, bool now) : Status(std::move(stored)), holds(now) {}
  bool holds = false;
};

class Accounts {
 public:
  using Then = std::function<void(const Outcome&)>;
  // Calendar time, so many seconds ahead, as utc_timestamp() words it.
  using Calendar = std::function<std::string(std::chrono::seconds ahead)>;
  static constexpr std::chrono::hours kSessionLife{12};
  static constexpr std::size_t kMostUsers = 100, kMostTokens = 100;
  static constexpr std::size_t kMostSessions = 16;  // of each user, and of each maker's links; the oldest go first
  static constexpr int kMostTokenDays = 3650;

  // `store` outlives this.
  Accounts(Calendar calendar, AccountStore& store) : calendar_(std::move(calendar)), store_(store) {}

  // What the store had when the daemon began.
  void load(std::vector<User> users, std::vector<Credential> credentials);
  // Called after anything ended: who is still signed in is to be asked anew.
  void on_ended(std::function<void()> told) { on_ended_ = std::move(told); }

  // Who has this secret: role, name and credential; nullopt when nobody has, or has not any more.
  std::optional<Caller> who_has(std::string_view secret) const;
  // Of a Caller that who_has() gave: does it hold still?
  bool holds(const Caller& caller) const;
  const Credential* find(const std::string& secret_hash) const;

  const User* user(const std::string& name) const;
  const std::map<std::string, User>& users() const { return users_; }
  std::vector<Credential> tokens() const;  // by user and name
  // The number of the last console link whose session is known.
  int last_link() const;

  void add_user(const std::string& name, Role role, std::string password, Then then);
  // Both end the user's sessions; tokens stay, with at most the new role. A higher role waits for the store.
  void set_role(const std::string& name, Role role, const Then& then);
  void set_password(const std::string& name, std::string password, const Then& then);
  // The same by the user, whose password was found to be `verified`: kConflict when it is another one by now.
  void change_password(const std::string& name, const std::string& verified, std::string password, const Then& then);
  void remove_user(const std::string& name, Then then);  // with sessions and tokens

  // `then` gets the secret, which nobody is ever told again.
  using GotSecret = std::function<void(const Result<std::string>&)>;
  // `verified` is the password's hash that was found right: kConflict when it is another one by now.
  void open_session(const std::string& user, const std::string& verified, const GotSecret& then);
  void open_link_session(const std::string& name, Role role, const GotSecret& then);
  // kInvalidArgument and kConflict as the name, the role and the days say. A user's tokens have names of their own.
  void new_token(const std::string& user, const std::string& name, Role role, int days, const GotSecret& then);
  // kNotFound when the user has no token of this name.
  void revoke_token(const std::string& user, const std::string& name, const Then& then);
  // Signing out; the end of what is not there is no error.
  void end(const std::string& secret_hash, const Then& then);
  // The sessions of all console links, whoever made these; `then` also gets how many they were.
  void end_link_sessions(const std::function<void(const Outcome&, std::size_t)>& then);
  // What is past its time, in the store too. Now and then.
  void forget_expired();

 private:
  struct Entry {
    Credential credential;
    std::uint64_t order = 0;  // of opening
  };
  void change(const std::string& name, const std::function<void(User&)>& how, const Then& then);
  void raise_role(const std::string& name, Role role, const Then& then);
  void end_sessions_of(const std::string& name);
  void end_all(const std::vector<std::string>& secret_hashes, const Then& then);
  Role role_of(const Credential& credential) const;
  std::string who(const Credential& credential) const;
  void open(Credential credential, const GotSecret& then);
  void erase_if(const std::function<bool(const Credential&)>& ends, std::vector<std::string>* ended = nullptr);
  void make_room(const Credential& coming);

  Calendar calendar_;
  AccountStore& store_;
  std::function<void()> on_ended_;
  std::map<std::string, User> users_;
  std::map<std::string, std::uint64_t> last_change_;  // of each user, counted by `changes_`
  std::uint64_t changes_ = 0;
  std::unordered_map<std::string, Entry> credentials_;  // by `secret`
  std::uint64_t next_order_ = 0;
};

// kInvalidArgument: what a name or a password has to be.
Status check_user_name(std::string_view name);
Status check_password(std::string_view password);

}  // namespace veneer::daemon
