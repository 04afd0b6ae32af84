#include "daemon/api/account_routes.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>

#include "daemon/api/request_reader.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr std::int64_t kUsualTokenDays = 90;

json user_json(const User& user) {
  return {
      {"name", user.name}, {"role", to_string(user.role)}, {"made_at", user.made_at}, {"changed_at", user.changed_at}};
}

Accounts::Then told_as(json done, const Reply& reply) {
  return [done = std::move(done), reply](const Outcome& outcome) { reply(reply_of(outcome, done)); };
}

Role role_in(RequestReader& body) {
  const auto word = body.word("role", {"viewer", "operator", "maintainer", "admin"});
  return role_of_name(word.value_or("")).value_or(Role::kViewer);
}

std::string new_password_in(RequestReader& body) {
  const auto password = body.text("password");
  body.require("password");
  if (password)
    if (const Status good = check_password(*password); !good) body.refuse(good.error());
  return password.value_or("");
}

void list_users(const AccountServices& s, const ApiRequest&, const Reply& reply) {
  json list = json::array();
  for (const auto& [name, user] : s.accounts.users()) list.push_back(user_json(user));
  reply(ApiReply::json({{"users", std::move(list)}}));
}

void add_user(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const Role role = role_in(body);
  body.require("role");
  const std::string password = new_password_in(body);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::string name = request.path_param("name");
  if (const Status good = check_user_name(name); !good) return reply(ApiReply::error(good.error()));
  s.passwords.hash(password, [s, name, role, reply](const Result<std::string>& hash) {
    if (!hash) return reply(ApiReply::error(hash.error()));
    s.accounts.add_user(name, role, *hash, told_as({{"name", name}, {"role", to_string(role)}}, reply));
  });
}

void remove_user(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  const std::string name = request.path_param("name");
  s.accounts.remove_user(name, told_as({{"name", name}}, reply));
}

void set_role(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const Role role = role_in(body);
  body.require("role");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::string name = request.path_param("name");
  s.accounts.set_role(name, role, told_as({{"name", name}, {"role", to_string(role)}}, reply));
}

void set_password(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const std::string password = new_password_in(body);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::string name = request.path_param("name");
  s.passwords.hash(password, [s, name, reply](const Result<std::string>& hash) {
    if (!hash) return reply(ApiReply::error(hash.error()));
    s.accounts.set_password(name, *hash, told_as({{"name", name}}, reply));
  });
}

void list_tokens(const AccountServices& s, const ApiRequest&, const Reply& reply) {
  json list = json::array();
  for (const Credential& token : s.accounts.tokens())
    list.push_back({{"user", token.user},
                    {"name", token.name},
                    {"role", to_string(token.role)},
                    {"made_at", token.made_at},
                    {"expires_at", token.expires_at}});
  reply(ApiReply::json({{"tokens", std::move(list)}}));
}

void new_token(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const Role role = role_in(body);
  body.require("role");
  const auto days = body.whole("days", {1, Accounts::kMostTokenDays});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::string user = request.path_param("name"), name = request.path_param("token");
  s.accounts.new_token(user, name, role, static_cast<int>(days.value_or(kUsualTokenDays)),
                       [&accounts = s.accounts, user, name, role, reply](const Result<std::string>& secret) {
                         if (!secret) return reply(ApiReply::error(secret.error()));
                         json told = {{"user", user}, {"name", name}, {"role", to_string(role)}, {"token", *secret}};
                         const auto caller = accounts.who_has(*secret);
                         const Credential* made = caller ? accounts.find(caller->credential) : nullptr;
                         if (made) told["expires_at"] = made->expires_at;
                         reply(ApiReply::json(told));
                       });
}

void revoke_token(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  const std::string user = request.path_param("name"), name = request.path_param("token");
  s.accounts.revoke_token(user, name, told_as({{"user", user}, {"name", name}}, reply));
}

}  // namespace

ApiReply reply_of(const Outcome& outcome, const json& done) {
  ApiReply reply = outcome ? ApiReply::json(done) : ApiReply::error(outcome.error());
  reply.changed = outcome.holds;
  return reply;
}

void bind_account_routes(Router& router, const AccountServices& s) {
  const auto bind = [&router, s](const char* id, auto answer) {
    router.bind(id, [s, answer](const ApiRequest& request, const Reply& reply) { answer(s, request, reply); });
  };
  bind("listUsers", list_users);
  bind("addUser", add_user);
  bind("removeUser", remove_user);
  bind("setUserRole", set_role);
  bind("setUserPassword", set_password);
  bind("listTokens", list_tokens);
  bind("newToken", new_token);
  bind("revokeToken", revoke_token);
}

}  // namespace veneer::daemon
