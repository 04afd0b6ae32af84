#include "daemon/api/api_message.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace veneer::daemon {

std::optional<Role> role_of_name(std::string_view name) {
  for (const Role role : {Role::kViewer, Role::kOperator, Role::kMaintainer, Role::kAdmin})
    if (name == to_string(role)) return role;
  return std::nullopt;
}

namespace {

template <class Number>
std::optional<Number> parse_whole(std::string_view text) {
  Number value{};
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// Where the message's last ": " begins that stands neither in brackets nor in quotation marks: those hold what others
// said (SQLite, the system), which is no advice. npos also where one of them is left open.
std::size_t before_remedy(std::string_view message) {
  std::size_t found = std::string_view::npos;
  int brackets = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < message.size(); ++i) {
    if (message[i] == '"') quoted = !quoted;
    if (quoted) continue;
    if (message[i] == '(') ++brackets;
    if (message[i] == ')' && brackets > 0) --brackets;
    if (brackets == 0 && message.substr(i, 2) == ": ") found = i;
  }
  return quoted || brackets > 0 ? std::string_view::npos : found;
}

}  // namespace

const std::string& ApiRequest::path_param(const std::string& name) const {
  const auto found = path_params.find(name);
  if (found == path_params.end()) std::abort();
  return found->second;
}

Result<std::int64_t> ApiRequest::path_number(const std::string& name) const {
  const std::string& text = path_param(name);
  const auto number = parse_whole<std::int64_t>(text);
  if (!number || *number < 1) {
    return Error{ErrorCode::kInvalidArgument, "\"" + text + "\" in the path is not a number: give one from 1"};
  }
  return *number;
}

std::string role_needed(const Caller& caller, Role role, const std::string& what) {
  const std::string needs = what + " needs the " + to_string(role) + " role: ";
  const std::string is = caller.who + " is " + to_string(caller.role);
  const bool more = role >= Role::kMaintainer;
  if (!caller.credential.empty()) {
    if (!more) return needs + is;
    if (caller.transport == TransportKind::kTls) return needs + is + "; somebody who has it can sign in here";
    return needs + is + "; somebody who has it can sign in here, or `sudo veneerctl console --role " + to_string(role) +
           "` on the cell's machine prints a link";
  }
  if (caller.transport == TransportKind::kTls) return needs + "sign in, or send a token";
  if (caller.transport == TransportKind::kTcp)
    return needs + "sign in, or open the link that `veneerctl console` prints in this browser";
  if (!more) return needs + is + "; ask for membership in the cell's operator group";
  return needs + is + "; run it with sudo" +
         (role == Role::kMaintainer ? ", or ask for membership in the group that maintainer_group names in veneerd.toml"
                                    : "");
}

nlohmann::json error_json(std::string_view code, std::string_view message) {
  const std::size_t colon = before_remedy(message);
  nlohmann::json out = {
      {"code", code}, {"sentence", message.substr(0, colon)}, {"remedy", nullptr}, {"message", message}};
  if (colon != std::string_view::npos) out["remedy"] = message.substr(colon + 2);
  return out;
}

ApiReply ApiReply::json(const nlohmann::json& value, int status) {
  ApiReply reply;
  reply.status = status;
  reply.content_type = "application/json";
  // Text that is not UTF-8 (a file name) is replaced rather than thrown about.
  const auto text = [](const nlohmann::json& j) {
    return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  if (value.is_object() && !value.contains("schema_version")) {
    nlohmann::json versioned = value;
    versioned["schema_version"] = 1;
    reply.body = text(versioned);
  } else {
    reply.body = text(value);
  }
  reply.body += '\n';
  return reply;
}

ApiReply ApiReply::bytes(std::string body, std::string content_type) {
  ApiReply reply;
  reply.content_type = std::move(content_type);
  reply.body = std::move(body);
  return reply;
}

ApiReply ApiReply::error(int status, std::string_view code, std::string_view message) {
  return json({{"error", error_json(code, message)}}, status);
}

ApiReply ApiReply::error(const Error& error) {
  return ApiReply::error(http_status(error.code), to_string(error.code), error.message);
}

ApiReply ApiReply::busy(std::string_view what) {
  ApiReply reply = error(503, "unavailable", std::string(what) + ": ask again in a second");
  reply.headers.emplace_back("Retry-After", "1");
  return reply;
}

ApiReply ApiReply::too_many(std::string_view what) {
  ApiReply reply = error(429, "too_many_requests", std::string(what) + ": wait until some of them are over");
  reply.headers.emplace_back("Retry-After", "1");
  return reply;
}

ApiReply ApiReply::not_modified(std::string etag) {
  ApiReply reply;
  reply.status = 304;
  reply.etag = std::move(etag);
  return reply;
}

bool etag_matches(std::string_view if_none_match, std::string_view etag) {
  while (!if_none_match.empty()) {
    const std::size_t end = std::min(if_none_match.find(','), if_none_match.size());
    std::string_view one = if_none_match.substr(0, end);
    if_none_match.remove_prefix(std::min(end + 1, if_none_match.size()));
    while (!one.empty() && one.front() == ' ') one.remove_prefix(1);
    while (!one.empty() && one.back() == ' ') one.remove_suffix(1);
    if (one.starts_with("W/")) one.remove_prefix(2);
    if (one == "*" || one == etag) return true;
  }
  return false;
}

ApiReply ApiReply::task(std::int64_t id) {
  ApiReply reply = json({{"task", id}}, 202);
  reply.began_task = id;
  return reply;
}

int http_status(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return 400;
    case ErrorCode::kNotFound:
      return 404;
    case ErrorCode::kConflict:
    case ErrorCode::kCancelled:
      return 409;
    case ErrorCode::kRefused:
      return 422;
    case ErrorCode::kUnavailable:
      return 503;
    case ErrorCode::kTimeout:
      return 504;
    case ErrorCode::kDisconnected:
    case ErrorCode::kDeviceFault:
      return 502;
    case ErrorCode::kStorage:
    case ErrorCode::kInternal:
      return 500;
  }
  return 500;
}

}  // namespace veneer::daemon
