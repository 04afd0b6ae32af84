// user, token, login, logout, whoami: who may do what, and who one is.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/password_prompt.h"
#include "cli/render.h"
#include "cli/sign_ins.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string or_fail(const Result<std::string>& password) {
  if (!password) fail(password.error(), kUnusableArguments);
  return *password;
}

CLI::Validator one_of_the_roles() { return CLI::IsMember({"viewer", "operator", "maintainer", "admin"}); }

constexpr const char* kRoles =
    "viewer looks, operator runs jobs, maintainer also calibrates and sets recipes, admin all";

struct Account {
  std::string user, role, token;
  int days = 90;
};

std::string target_of(const std::string& user, const std::string& more = "") {
  return "/users/" + url_encode(user) + more;
}

// What was done, in a sentence.
CommandContext::Render said(std::string sentence) {
  return [sentence = std::move(sentence)](const json&) { return sentence + "\n"; };
}

void add_user_changes(CLI::App& users, CommandContext& context) {
  const auto given = std::make_shared<Account>();
  given->role = "operator";
  CLI::App* add =
      users.add_subcommand("add", "Make an account; the password is asked for, or read from standard input");
  CLI::App* role = users.add_subcommand("role", "Give a user another role; their sessions end");
  CLI::App* password = users.add_subcommand(
      "password", "Give a user another password, which is asked for, or read from standard input; their sessions end");
  CLI::App* remove = users.add_subcommand("remove", "Remove an account, with its sessions and tokens");
  for (CLI::App* command : {add, role, password, remove})
    command->add_option("NAME", given->user, "The user's name: small letters, digits, dots and dashes")->required();
  add->add_option("--role", given->role, kRoles)->check(one_of_the_roles())->capture_default_str();
  role->add_option("ROLE", given->role, kRoles)->required()->check(one_of_the_roles());
  add->callback([given, &context] {
    const std::string secret = or_fail(ask_new_password(given->user));
    context.finish_step(context.client().post(target_of(given->user), {{"role", given->role}, {"password", secret}}),
                        said(fmt::format("{} may sign in as {}.", given->user, given->role)));
  });
  role->callback([given, &context] {
    context.finish_step(context.client().post(target_of(given->user, "/role"), {{"role", given->role}}),
                        said(fmt::format("{} is {} from the next sign-in on.", given->user, given->role)));
  });
  password->callback([given, &context] {
    const std::string secret = or_fail(ask_new_password(given->user));
    context.finish_step(context.client().post(target_of(given->user, "/password"), {{"password", secret}}),
                        said(fmt::format("{} signs in with the new password from now on.", given->user)));
  });
  remove->callback([given, &context] {
    context.finish_step(context.client().request("DELETE", target_of(given->user), "", ""),
                        said(fmt::format("{} is removed, and signed out everywhere.", given->user)));
  });
}

void add_user(CLI::App& app, CommandContext& context) {
  CLI::App* users = app.add_subcommand("user", "Accounts: who may sign in, and as what");
  users->require_subcommand(1);
  users->add_subcommand("list", "All accounts")->callback([&context] {
    context.finish(context.client().get("/users"), render_users);
  });
  add_user_changes(*users, context);
}

void add_token(CLI::App& app, CommandContext& context) {
  CLI::App* tokens = app.add_subcommand("token", "Tokens, by which programs sign in (VENEERD_TOKEN)");
  tokens->require_subcommand(1);
  tokens->add_subcommand("list", "All tokens, without their secrets")->callback([&context] {
    context.finish(context.client().get("/tokens"), render_tokens);
  });
  const auto given = std::make_shared<Account>();
  given->role = "viewer";
  CLI::App* add = tokens->add_subcommand("new", "Make a token; it is shown this once");
  CLI::App* revoke = tokens->add_subcommand("revoke", "End a token");
  for (CLI::App* command : {add, revoke}) {
    command->add_option("USER", given->user, "Whose it is; it may never do more than this user")->required();
    command->add_option("NAME", given->token, "What it is for, as in \"press room\"")->required();
  }
  add->add_option("--role", given->role, kRoles)->check(one_of_the_roles())->capture_default_str();
  add->add_option("--days", given->days, "How long it is good for")->check(CLI::Range(1, 3650))->capture_default_str();
  const auto target = [given] { return target_of(given->user, "/tokens/" + url_encode(given->token)); };
  add->callback([given, target, &context] {
    context.finish(context.client().post(target(), {{"role", given->role}, {"days", given->days}}),
                   [](const json& made) { return text_or(made, "token", "") + "\n"; });
  });
  revoke->callback([given, target, &context] {
    context.finish_step(context.client().request("DELETE", target(), "", ""),
                        said(fmt::format("The token {} of {} is revoked.", given->token, given->user)));
  });
}

void add_login(CLI::App& app, CommandContext& context) {
  const auto user = std::make_shared<std::string>();
  CLI::App* login =
      app.add_subcommand("login", "Sign in at a cell on another machine (--socket https://HOST:PORT) for twelve hours");
  login->add_option("NAME", *user, "Your name there")->required();
  login->callback([user, &context] {
    const ApiClient client = context.client();
    if (!client.address().tls)
      fail({ErrorCode::kInvalidArgument,
            "on this machine nobody needs to sign in; another one is --socket https://HOST:PORT"},
           kUnusableArguments);
    const std::string password = or_fail(ask_password("Password of " + *user));
    const auto opened = client.post("/session", {{"user", *user}, {"password", password}});
    if (opened)
      if (Status kept = keep_secret(context.socket, text_or(*opened, "session", "")); !kept) fail(kept.error());
    auto told = opened;
    if (told) told->erase("session");
    context.finish_step(told, render_who);
  });
  app.add_subcommand("logout", "Sign out at a cell on another machine")->callback([&context] {
    const auto closed = context.client().request("DELETE", "/session", "", "");
    if (Status forgotten = keep_secret(context.socket, ""); !forgotten) fail(forgotten.error());
    context.finish(closed, said("Signed out."));
  });
  app.add_subcommand("whoami", "Who you are for the cell, and what you may do")->callback([&context] {
    context.finish(context.client().get("/session"), render_who);
  });
}

}  // namespace

void add_account_commands(CLI::App& app, CommandContext& context) {
  add_user(app, context);
  add_token(app, context);
  add_login(app, context);
}

}  // namespace veneer::cli
