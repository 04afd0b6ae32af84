// What a route handler sees of a request and gives back. Nothing here knows of sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "daemon/api/shared_text.h"

namespace veneer::daemon {

// Each role may do what the ones before it may. STOP needs nothing, starting motion needs kOperator, what changes how
// every later cut comes out kMaintainer, accounts kAdmin. kNobody has not signed in and is not on this machine.
enum class Role { kNobody, kViewer, kOperator, kMaintainer, kAdmin };
constexpr const char* to_string(Role role) {
  switch (role) {
    case Role::kNobody:
      return "nobody";
    case Role::kViewer:
      return "viewer";
    case Role::kOperator:
      return "operator";
    case Role::kMaintainer:
      return "maintainer";
    case Role::kAdmin:
      return "admin";
  }
  return "nobody";
}
// One that a person or a token may have: viewer to admin; nullopt for any other word.
std::optional<Role> role_of_name(std::string_view name);

enum class TransportKind { kUnix, kTcp, kTls };

struct Caller {
  Role role = Role::kViewer;
  // For the audit: "uid 1000", "user anna", "token press of user anna", "console link 3 of uid 1000", "anonymous",
  // "anonymous at 192.168.1.7".
  std::string who;
  TransportKind transport = TransportKind::kTcp;
  std::string user = {};        // whose account; "": none
  std::string credential = {};  // which session or token (Accounts); "": none
};

// Finds out who sends a request, by the secret that came with it.
using WhoAsks = std::function<const Caller&()>;

// That `caller` may not do this, and how somebody comes by that role.
std::string role_needed(const Caller& caller, Role role, const std::string& what = "this");

struct ApiRequest {
  std::string method;                              // "GET", "POST", "DELETE"
  std::string path;                                // "/api/v1/jobs/7/start", as sent, without the query
  std::map<std::string, std::string> path_params;  // decoded; names as in the route's pattern
  std::map<std::string, std::string> query;        // decoded; read it with a RequestReader
  std::optional<std::string> repeated_query;       // a name that stands twice in the query
  SharedText body;                                 // read it with a RequestReader, unless it is a picture
  std::string content_type;
  std::string if_none_match;    // ETags of what the client has already
  std::string accept_encoding;  // how the reply may be packed: see gzip.h
  std::string idempotency_key;  // empty: none
  std::string body_sha256;      // of a large body that came with a key, hashed as it came in; else empty
  Caller caller;
  std::string address;   // where it comes from: "192.168.1.7"; over the Unix socket that of nobody, ""
  std::stop_token gone;  // stops when the client goes away: nobody needs the reply any more

  // A parameter of the route's own pattern; asking for another is a bug and aborts.
  const std::string& path_param(const std::string& name) const;
  // kInvalidArgument when it is not a whole number from 1.
  Result<std::int64_t> path_number(const std::string& name) const;
};

struct ApiReply {
  int status = 200;
  std::string content_type;
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::optional<std::int64_t> began_task;  // of a 202
  // Did something change, where the status does not tell? An error may be about a change that holds all the same.
  std::optional<bool> changed;
  std::string signed_in;  // who somebody is from now on: it is noted under that name
  std::string etag;       // of the content, quoted; with one the client may keep it and ask whether it is still good

  // Objects get "schema_version": 1 when they have none.
  static ApiReply json(const nlohmann::json& value, int status = 200);
  static ApiReply bytes(std::string body, std::string content_type);
  // {"error": error_json()} with http_status(error.code).
  static ApiReply error(const Error& error);
  // The same with a status of its own: what HTTP knows and ErrorCode does not (403, 405, 413, ...).
  static ApiReply error(int status, std::string_view code, std::string_view message);
  // 503 with Retry-After: the cell has no room for more. `what` says of what there is too much.
  static ApiReply busy(std::string_view what);
  // 429 with Retry-After: this client has more under way than its share. `what` says of what.
  static ApiReply too_many(std::string_view what);
  // 304
  static ApiReply not_modified(std::string etag);
  // 202 {"task": N}
  static ApiReply task(std::int64_t id);
};

// {"code", "sentence", "remedy", "message"}: what happened and what to do about it, apart and, for those who want one
// sentence, together. By this program's custom a message says "what: remedy"; where it does not, the remedy is null.
nlohmann::json error_json(std::string_view code, std::string_view message);

// Is `etag` among those of an If-None-Match header?
bool etag_matches(std::string_view if_none_match, std::string_view etag);

// Call it once, from any thread, while the reactor exists; later calls do nothing. Dropped without a call, the client
// gets 500.
using Reply = std::function<void(ApiReply)>;
using Handler = std::function<void(const ApiRequest&, Reply)>;

// invalid_argument 400, not_found 404, conflict and cancelled 409, refused 422, unavailable 503, timeout 504,
// disconnected and device_fault 502, storage and internal 500.
int http_status(ErrorCode code);

}  // namespace veneer::daemon
