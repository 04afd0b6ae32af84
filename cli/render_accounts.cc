// Accounts and tokens, in words.
#include <fmt/format.h>

#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string date_of(const json& object, const char* key) { return text_or(object, key, "").substr(0, 10); }

}  // namespace

std::string render_users(const json& reply) {
  const json& users = member(reply, "users");
  if (!users.is_array() || users.empty()) return "There are no accounts yet: `veneerctl user add NAME` makes one.\n";
  TextTable table({"USER", "ROLE", "MADE", "CHANGED"});
  for (const json& user : users)
    table.add(
        {text_or(user, "name", ""), text_or(user, "role", ""), date_of(user, "made_at"), date_of(user, "changed_at")});
  return table.str();
}

std::string render_tokens(const json& reply) {
  const json& tokens = member(reply, "tokens");
  if (!tokens.is_array() || tokens.empty()) return "There are no tokens: `veneerctl token new USER NAME` makes one.\n";
  TextTable table({"USER", "TOKEN", "ROLE", "MADE", "ENDS"});
  for (const json& token : tokens)
    table.add({text_or(token, "user", ""), text_or(token, "name", ""), text_or(token, "role", ""),
               date_of(token, "made_at"), date_of(token, "expires_at")});
  return table.str();
}

std::string render_ended_links(const json& reply) {
  const auto of = [](std::int64_t count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
  };
  return fmt::format("{} signed out, {} that nobody had used forgotten.\n",
                     of(whole_or(reply, "sessions", 0), "browser"), of(whole_or(reply, "links", 0), "link"));
}

std::string render_who(const json& session) {
  std::string text = fmt::format("You are {}, and may do what a {} may.", text_or(session, "who", "nobody"),
                                 text_or(session, "role", "viewer"));
  const std::string role = text_or(session, "role", "");
  if (role == "nobody")
    text = "You have not signed in: `veneerctl login NAME`. STOP works without.";
  else if (role == "admin" || role == "operator")
    text.replace(text.find(" a "), 3, " an ");
  if (const std::string until = text_or(session, "expires_at", ""); !until.empty())
    text += fmt::format(" Until {} UTC.", until.substr(0, 16).replace(10, 1, " "));
  return text + "\n";
}

}  // namespace veneer::cli
