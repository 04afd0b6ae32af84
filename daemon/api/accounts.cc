#include "daemon/api/accounts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <span>
#include <tuple>
#include <utility>

#include "base/hash.h"
#include "daemon/api/random_token.h"

namespace veneer::daemon {
namespace {

std::string hash_of(std::string_view secret) { return sha256_hex(std::as_bytes(std::span(secret))); }

Error no_user(const std::string& name) {
  return Error{ErrorCode::kNotFound, fmt::format("there is no user {}: see `veneerctl user list`", name)};
}

Outcome not_done(Error why) { return {std::move(why), false}; }

Error changed_meanwhile() {
  return Error{ErrorCode::kConflict, "the account was changed at this very moment: sign in again"};
}

// It holds now, and the file may say otherwise.
Outcome until_restart(const Status& stored) {
  if (stored.ok()) return {stored, true};
  return {Error{stored.error().code,
                "it holds until veneerd is started again, but could not be written: " + stored.error().message},
          true};
}

// Of "console link 3 of uid 1000" what follows the number.
std::string_view maker_of(std::string_view link) {
  constexpr std::string_view kOf = " of ";
  const auto of = link.find(kOf);
  return of == std::string_view::npos ? link : link.substr(of + kOf.size());
}

// Sessions of one user, or of links that one maker made.
bool belong_together(const Credential& a, const Credential& b) {
  return a.user == b.user && (!a.user.empty() || maker_of(a.name) == maker_of(b.name));
}

}  // namespace

Status check_user_name(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const bool good =
      !name.empty() && name.size() <= 32 && letter(name.front()) && std::ranges::all_of(name, [&](char c) {
        return letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
      });
  if (good) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               "a user's name is 1 to 32 small letters, digits, dots and dashes, and begins with a letter: choose "
               "another"};
}

Status check_password(std::string_view password) {
  if (password.size() >= 8 && password.size() <= 256) return Ok();
  return Error{ErrorCode::kInvalidArgument, "a password has 8 to 256 characters: choose another"};
}

void Accounts::load(std::vector<User> users, std::vector<Credential> credentials) {
  for (User& user : users) users_.insert_or_assign(user.name, std::move(user));
  for (Credential& credential : credentials) {
    std::string secret = credential.secret;
    credentials_.insert_or_assign(std::move(secret), Entry{std::move(credential), next_order_++});
  }
}

// ---- who it is ------------------------------------------------------------------------------------------------------

Role Accounts::role_of(const Credential& credential) const {
  if (credential.user.empty()) return credential.role;
  const User* of = user(credential.user);
  return of ? std::min(credential.role, of->role) : Role::kNobody;
}

std::string Accounts::who(const Credential& credential) const {
  if (credential.user.empty()) return credential.name;
  if (credential.kind == CredentialKind::kToken)
    return fmt::format("token {} of user {}", credential.name, credential.user);
  return "user " + credential.user;
}

const Credential* Accounts::find(const std::string& secret_hash) const {
  const auto found = credentials_.find(secret_hash);
  if (found == credentials_.end()) return nullptr;
  const Credential& credential = found->second.credential;
  if (credential.expires_at <= calendar_(std::chrono::seconds(0))) return nullptr;
  return credential.user.empty() || user(credential.user) ? &credential : nullptr;
}

std::optional<Caller> Accounts::who_has(std::string_view secret) const {
  if (secret.empty()) return std::nullopt;
  std::string hash = hash_of(secret);
  const Credential* credential = find(hash);
  if (!credential) return std::nullopt;
  Caller caller{role_of(*credential), who(*credential), TransportKind::kTcp};
  caller.user = credential->user;
  caller.credential = std::move(hash);
  return caller;
}

bool Accounts::holds(const Caller& caller) const {
  if (caller.credential.empty()) return true;
  const Credential* credential = find(caller.credential);
  return credential && role_of(*credential) == caller.role;
}

const User* Accounts::user(const std::string& name) const {
  const auto found = users_.find(name);
  return found == users_.end() ? nullptr : &found->second;
}

std::vector<Credential> Accounts::tokens() const {
  std::vector<Credential> out;
  for (const auto& [secret, entry] : credentials_)
    if (entry.credential.kind == CredentialKind::kToken) out.push_back(entry.credential);
  std::ranges::sort(out, {}, [](const Credential& c) { return std::tie(c.user, c.name); });
  return out;
}

int Accounts::last_link() const {
  int last = 0;
  for (const auto& [secret, entry] : credentials_) {
    int number = 0;
    if (entry.credential.user.empty() && std::sscanf(entry.credential.name.c_str(), "console link %9d", &number) == 1)
      last = std::max(last, number);
  }
  return last;
}

// ---- users ----------------------------------------------------------------------------------------------------------

void Accounts::add_user(const std::string& name, Role role, std::string password, Then then) {
  if (const Status good = check_user_name(name); !good) return then(not_done(good.error()));
  if (users_.contains(name))
    return then(not_done({ErrorCode::kConflict,
                          fmt::format("there is a user {} already: take another name, or change that one", name)}));
  if (users_.size() >= kMostUsers)
    return then(
        not_done({ErrorCode::kConflict, fmt::format("there are {} users already: remove one first", kMostUsers)}));
  const std::string now = calendar_(std::chrono::seconds(0));
  const User made{name, role, std::move(password), now, now};
  store_.add(made, [this, made, then = std::move(then)](const Status& stored) {
    if (stored) users_.insert_or_assign(made.name, made);
    then({stored, stored.ok()});
  });
}

// First here, so that no session is opened by what was true until now.
void Accounts::change(const std::string& name, const std::function<void(User&)>& how, const Then& then) {
  const auto found = users_.find(name);
  if (found == users_.end()) return then(not_done(no_user(name)));
  how(found->second);
  last_change_[name] = ++changes_;
  found->second.changed_at = calendar_(std::chrono::seconds(0));
  store_.change(found->second, [then](const Status& stored) { then(until_restart(stored)); });
  end_sessions_of(name);
}

void Accounts::end_sessions_of(const std::string& name) {
  erase_if([&](const Credential& c) { return c.kind == CredentialKind::kSession && c.user == name; });
  if (on_ended_) on_ended_();
}

// Who was changed again while the store wrote is what the later change says: the store has it so too.
void Accounts::raise_role(const std::string& name, Role role, const Then& then) {
  const std::uint64_t mine = last_change_[name] = ++changes_;
  User raised = users_.at(name);
  raised.role = role;
  raised.changed_at = calendar_(std::chrono::seconds(0));
  store_.change(raised, [this, raised, mine, then](const Status& stored) {
    if (!stored) return then(not_done(stored.error()));
    if (!users_.contains(raised.name)) return then(not_done(no_user(raised.name)));  // removed meanwhile
    if (last_change_[raised.name] != mine)
      return then(
          not_done({ErrorCode::kConflict, fmt::format("{} was changed at this very moment: look what {} is now, "
                                                      "and try again",
                                                      raised.name, raised.name)}));
    users_[raised.name] = raised;
    end_sessions_of(raised.name);
    then({stored, true});
  });
}

void Accounts::set_role(const std::string& name, Role role, const Then& then) {
  if (const User* of = user(name); of && role > of->role) return raise_role(name, role, then);
  change(
      name, [role](User& user) { user.role = role; }, then);
}

void Accounts::set_password(const std::string& name, std::string password, const Then& then) {
  change(
      name, [&](User& user) { user.password = std::move(password); }, then);
}

void Accounts::change_password(const std::string& name, const std::string& verified, std::string password,
                               const Then& then) {
  if (const User* of = user(name); of && of->password != verified) return then(not_done(changed_meanwhile()));
  set_password(name, std::move(password), then);
}

void Accounts::remove_user(const std::string& name, Then then) {
  if (users_.erase(name) == 0) return then(not_done(no_user(name)));
  last_change_.erase(name);
  erase_if([&](const Credential& c) { return c.user == name; });
  store_.remove_user(name, [then = std::move(then)](const Status& stored) { then(until_restart(stored)); });
  if (on_ended_) on_ended_();
}

// ---- sessions and tokens --------------------------------------------------------------------------------------------

void Accounts::erase_if(const std::function<bool(const Credential&)>& ends, std::vector<std::string>* ended) {
  std::erase_if(credentials_, [&](const auto& one) {
    if (!ends(one.second.credential)) return false;
    if (ended) ended->push_back(one.first);
    return true;
  });
}

void Accounts::make_room(const Credential& coming) {
  std::vector<const Entry*> sessions;
  for (const auto& [secret, entry] : credentials_)
    if (entry.credential.kind == CredentialKind::kSession && belong_together(entry.credential, coming))
      sessions.push_back(&entry);
  if (sessions.size() < kMostSessions) return;
  const Entry* oldest = *std::ranges::min_element(sessions, {}, [](const Entry* entry) { return entry->order; });
  end(std::string(oldest->credential.secret), [](const Outcome&) {});
}

void Accounts::open(Credential credential, const GotSecret& then) {
  auto secret = random_token();
  if (!secret) return then(secret.error());
  credential.secret = hash_of(*secret);
  credential.made_at = calendar_(std::chrono::seconds(0));
  const bool session = credential.kind == CredentialKind::kSession;
  if (session) {
    make_room(credential);
    credential.expires_at = calendar_(kSessionLife);
    credentials_.insert_or_assign(credential.secret, Entry{credential, next_order_++});
  }
  store_.add(credential, [this, session, credential, secret = std::move(*secret), then](const Status& stored) {
    // A session that could not be written ends with the daemon.
    if (session) return then(secret);
    if (!stored) return then(stored.error());
    if (!users_.contains(credential.user)) return then(no_user(credential.user));  // removed meanwhile
    credentials_.insert_or_assign(credential.secret, Entry{credential, next_order_++});
    then(secret);
  });
}

void Accounts::open_session(const std::string& name, const std::string& verified, const GotSecret& then) {
  const User* of = user(name);
  if (!of || of->password != verified) return then(changed_meanwhile());
  open({{}, CredentialKind::kSession, name, {}, of->role, {}, {}}, then);
}

void Accounts::open_link_session(const std::string& name, Role role, const GotSecret& then) {
  open({{}, CredentialKind::kSession, {}, name, role, {}, {}}, then);
}

void Accounts::new_token(const std::string& name, const std::string& token, Role role, int days,
                         const GotSecret& then) {
  const User* of = user(name);
  if (!of) return then(no_user(name));
  if (token.empty() || token.size() > 64)
    return then(Error{ErrorCode::kInvalidArgument, "a token's name has 1 to 64 characters: say what it is for"});
  if (role > of->role)
    return then(Error{ErrorCode::kRefused, fmt::format("{} is {}, and a token may not be more: give a lower role", name,
                                                       to_string(of->role))});
  const auto all = tokens();
  if (std::ranges::any_of(all, [&](const Credential& c) { return c.user == name && c.name == token; }))
    return then(Error{ErrorCode::kConflict,
                      fmt::format("{} has a token {} already: revoke it, or take another name", name, token)});
  if (all.size() >= kMostTokens)
    return then(Error{ErrorCode::kConflict, fmt::format("there are {} tokens already: revoke one first", kMostTokens)});
  Credential credential{{}, CredentialKind::kToken, name, token, role, {}, {}};
  credential.expires_at = calendar_(std::chrono::days(std::clamp(days, 1, kMostTokenDays)));
  open(std::move(credential), then);
}

void Accounts::revoke_token(const std::string& name, const std::string& token, const Then& then) {
  std::vector<std::string> secrets;
  for (const Credential& one : tokens())
    if (one.user == name && one.name == token) secrets.push_back(one.secret);
  if (!secrets.empty()) return end_all(secrets, then);
  then(not_done({ErrorCode::kNotFound, fmt::format("{} has no token {}: see `veneerctl token list`", name, token)}));
}

void Accounts::end(const std::string& secret_hash, const Then& then) { end_all({secret_hash}, then); }

void Accounts::end_all(const std::vector<std::string>& secret_hashes, const Then& then) {
  for (const std::string& secret : secret_hashes) credentials_.erase(secret);
  store_.end(secret_hashes, [then](const Status& stored) { then(until_restart(stored)); });
  if (on_ended_) on_ended_();
}

void Accounts::end_link_sessions(const std::function<void(const Outcome&, std::size_t)>& then) {
  std::vector<std::string> secrets;
  for (const auto& [secret, entry] : credentials_)
    if (entry.credential.user.empty()) secrets.push_back(secret);
  end_all(secrets, [then, count = secrets.size()](const Outcome& ended) { then(ended, count); });
}

void Accounts::forget_expired() {
  const std::string now = calendar_(std::chrono::seconds(0));
  std::vector<std::string> ended;
  erase_if([&](const Credential& c) { return c.expires_at <= now; }, &ended);
  if (ended.empty()) return;
  store_.end(ended, [](const Status&) {});
  if (on_ended_) on_ended_();
}

}  // namespace veneer::daemon
