// Signing in by a password or a console link, and out.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "daemon/api/access.h"
#include "daemon/api/account_routes.h"
#include "daemon/api/request_reader.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

std::string cookie(std::string_view secret, std::chrono::seconds life) {
  return fmt::format("{}={}; Path=/; Secure; HttpOnly; SameSite=Strict; Max-Age={}", kCookie, secret, life.count());
}

json session_json(const Accounts& accounts, const Caller& caller) {
  const Credential* credential = accounts.find(caller.credential);
  return {{"role", to_string(caller.role)},
          {"who", caller.who},
          {"user", caller.user.empty() ? json() : json(caller.user)},
          {"expires_at", credential ? json(credential->expires_at) : json()}};
}

// What a session that was just opened is answered with. In a cookie the page's own scripts never see the secret.
ApiReply opened(const Accounts& accounts, const Result<std::string>& secret, bool in_cookie) {
  if (!secret) return ApiReply::error(secret.error());
  const auto caller = accounts.who_has(*secret);
  if (!caller) return ApiReply::error(Error{ErrorCode::kConflict, "the account has just been removed"});
  json told = session_json(accounts, *caller);
  if (!in_cookie) told["session"] = *secret;
  ApiReply reply = ApiReply::json(told);
  if (in_cookie) reply.headers.emplace_back("Set-Cookie", cookie(*secret, Accounts::kSessionLife));
  reply.signed_in = caller->who;
  return reply;
}

ApiReply wait_first(std::chrono::seconds wait) {
  ApiReply reply = ApiReply::error(
      429, "too_many_requests",
      fmt::format("too many tries to sign in: wait {}, or use a link of `veneerctl console` on the machine itself",
                  wait < std::chrono::minutes(2) ? fmt::format("{} s", wait.count())
                                                 : fmt::format("{} minutes", (wait.count() + 59) / 60)));
  reply.headers.emplace_back("Retry-After", std::to_string(wait.count()));
  return reply;
}

// One try of a password, counted; `then` with whether it is right, `reply` when that was not even looked at.
void try_password(const AccountServices& s, const std::string& name, const ApiRequest& request, std::string password,
                  const Reply& reply, std::function<void(bool right, const std::string& hash)> then) {
  const std::string address = request.address.empty() ? request.caller.who : request.address;
  const User* user = s.accounts.user(name);
  const std::string known = user ? name : "";
  if (const auto wait = s.throttle.begin(known, address)) {
    s.log->warn("signing in as {} from {} was tried too often", name, address);
    return reply(wait_first(*wait));
  }
  const std::string hash = user ? user->password : "";
  const bool signed_in = !request.caller.credential.empty();
  const Asker asker = signed_in || s.throttle.knows(request.address) ? Asker::kKnown : Asker::kStranger;
  s.passwords.verify(hash, std::move(password), asker,
                     [s, name, known, address, hash, reply, then = std::move(then)](const Result<bool>& right) {
                       if (!right) {
                         s.throttle.give_back(known, address);
                         return reply(ApiReply::error(right.error()));
                       }
                       if (*right)
                         s.throttle.was_right(known, address);
                       else
                         s.log->warn("signing in as {} from {} was refused", name, address);
                       then(*right, hash);
                     });
}

ApiReply wrong_password() {
  return ApiReply::error(403, "forbidden", "the name or the password is not right: try again");
}

void open_session(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto token = body.text("token");
  const auto user = body.text("user");
  const auto password = body.text("password");
  const bool in_cookie = body.flag("cookie").value_or(false);
  if (!token) body.require("user"), body.require("password");
  if (token && (user || password))
    body.refuse({ErrorCode::kInvalidArgument, "a console link's token needs no name and no password: leave them out"});
  if (in_cookie && request.caller.transport != TransportKind::kTls)
    body.refuse({ErrorCode::kInvalidArgument, "a cookie is for HTTPS only: leave `cookie` out"});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const auto done = [&accounts = s.accounts, in_cookie, reply](const Result<std::string>& secret) {
    reply(opened(accounts, secret, in_cookie));
  };
  if (token) {
    const auto link = s.links.redeem(*token);
    if (!link) return reply(ApiReply::error(403, "forbidden", link.error().message));
    return s.accounts.open_link_session(link->who, link->role, done);
  }
  std::string name = *user;
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
  if (!check_user_name(name) || password->size() > 256) return reply(wrong_password());
  try_password(s, name, request, *password, reply, [s, name, done, reply](bool right, const std::string& hash) {
    if (!right) return reply(wrong_password());
    s.accounts.open_session(name, hash, done);
  });
}

void close_session(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  const Credential* credential = s.accounts.find(request.caller.credential);
  if (credential && credential->kind == CredentialKind::kToken)
    return reply(ApiReply::error(
        Error{ErrorCode::kConflict, "a token is not signed out but revoked: `veneerctl token revoke`"}));
  const auto done = [reply, tls = request.caller.transport == TransportKind::kTls](const Outcome& ended) {
    ApiReply told = reply_of(ended, json::object());
    if (tls) told.headers.emplace_back("Set-Cookie", cookie("", std::chrono::seconds(0)));
    reply(std::move(told));
  };
  if (!credential) return done(Outcome{Ok(), false});  // anybody may ask for this without end: nobody notes it
  s.accounts.end(request.caller.credential, done);
}

// One's own. It ends all sessions of the user, this one too.
void change_password(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto old = body.text("old");
  const auto password = body.text("password");
  body.require("old"), body.require("password");
  if (password)
    if (const Status good = check_password(*password); !good) body.refuse(good.error());
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::string name = request.caller.user;
  if (name.empty())
    return reply(
        ApiReply::error(403, "forbidden", "only who has signed in with a password may change it so: sign in with it"));
  try_password(s, name, request, *old, reply,
               [s, name, password = *password, reply](bool right, const std::string& verified) {
                 if (!right)
                   return reply(ApiReply::error(403, "forbidden", "the old password is not right: try again"));
                 s.passwords.hash(password, [s, name, verified, reply](const Result<std::string>& hash) {
                   if (!hash) return reply(ApiReply::error(hash.error()));
                   s.accounts.change_password(name, verified, *hash,
                                              [reply](const Outcome& done) { reply(reply_of(done, json::object())); });
                 });
               });
}

void answer_new_link(const AccountServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto word = body.word("role", {"viewer", "operator", "maintainer", "admin"});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (request.caller.transport != TransportKind::kUnix)
    return reply(
        ApiReply::error(403, "forbidden", "console links are made on the machine itself: `veneerctl console`"));
  const Role role = role_of_name(word.value_or("operator")).value_or(Role::kOperator);
  if (role > request.caller.role)
    return reply(ApiReply::error(403, "forbidden",
                                 fmt::format("{} is {}, and a link may not be more: ask for a lower role",
                                             request.caller.who, to_string(request.caller.role))));
  const std::string url = s.console_url ? s.console_url() : "";
  if (url.empty())
    return reply(ApiReply::error(
        Error{ErrorCode::kConflict, "the console is off: set listen = \"127.0.0.1:8765\" under [api] and restart"}));
  const auto token = s.links.new_link(request.caller.who, role);
  if (!token) return reply(ApiReply::error(token.error()));
  reply(ApiReply::json({{"url", url + "/console#token=" + *token}, {"role", to_string(role)}}));
}

// Whoever has a link's session has no name by which it could be ended.
void end_console_links(const AccountServices& s, const ApiRequest&, const Reply& reply) {
  const std::size_t links = s.links.forget_unused();
  s.accounts.end_link_sessions([links, reply](const Outcome& ended, std::size_t sessions) {
    reply(reply_of(ended, {{"links", links}, {"sessions", sessions}}));
  });
}

}  // namespace

void bind_session_routes(Router& router, const AccountServices& s) {
  router.bind("getSession", [&accounts = s.accounts](const ApiRequest& request, const Reply& reply) {
    json told = session_json(accounts, request.caller);
    told["accounts"] = !accounts.users().empty();
    reply(ApiReply::json(told));
  });
  const auto bind = [&router, s](const char* id, auto answer) {
    router.bind(id, [s, answer](const ApiRequest& request, const Reply& reply) { answer(s, request, reply); });
  };
  bind("openSession", open_session);
  bind("closeSession", close_session);
  bind("changePassword", change_password);
  bind("newConsoleLink", answer_new_link);
  bind("endConsoleLinks", end_console_links);
}

}  // namespace veneer::daemon
