// What a route handler sees of a request and gives back. Nothing here knows of sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

// Each role may do what the ones before it may. Starting motion needs kOperator; STOP needs nothing.
enum class Role { kViewer, kOperator, kMaintainer, kAdmin };
constexpr const char* to_string(Role role) {
  switch (role) {
    case Role::kViewer:
      return "viewer";
    case Role::kOperator:
      return "operator";
    case Role::kMaintainer:
      return "maintainer";
    case Role::kAdmin:
      return "admin";
  }
  return "viewer";
}

enum class TransportKind { kUnix, kTcp };

struct Caller {
  Role role = Role::kViewer;
  std::string who;  // for the audit: "uid 1000", "console", "anonymous"
  TransportKind transport = TransportKind::kTcp;
};

struct ApiRequest {
  std::string method;                              // "GET", "POST", "DELETE"
  std::string path;                                // "/api/v1/jobs/7/start", as sent, without the query
  std::map<std::string, std::string> path_params;  // decoded; names as in the route's pattern
  std::map<std::string, std::string> query;        // decoded; of a repeated name the last one counts
  std::string body;
  std::string content_type;
  Caller caller;

  // A parameter of the route's own pattern; asking for another is a bug and aborts.
  const std::string& path_param(const std::string& name) const;
  // kInvalidArgument when it is not a whole number from 1.
  Result<std::int64_t> path_number(const std::string& name) const;
  std::optional<std::string> query_value(const std::string& name) const;
  // nullopt when absent, kInvalidArgument when it is not a finite number.
  Result<std::optional<double>> query_number(const std::string& name) const;
  // The body as a JSON object; an empty body is {}. kInvalidArgument when it is anything else.
  Result<nlohmann::json> json_body() const;
};

struct ApiReply {
  int status = 200;
  std::string content_type;
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;

  // Objects get "schema_version": 1 when they have none.
  static ApiReply json(const nlohmann::json& value, int status = 200);
  static ApiReply bytes(std::string body, std::string content_type);
  // {"error": {"code", "message"}} with http_status(error.code).
  static ApiReply error(const Error& error);
  // The same with a status of its own: what HTTP knows and ErrorCode does not (403, 405, 413, ...).
  static ApiReply error(int status, std::string_view code, std::string_view message);
  // 202 {"task": N}
  static ApiReply task(std::int64_t id);
};

// Call it once, from any thread, while the reactor exists; later calls do nothing. Dropped without a call, the client
// gets 500.
using Reply = std::function<void(ApiReply)>;
using Handler = std::function<void(const ApiRequest&, Reply)>;

// invalid_argument 400, not_found 404, conflict and cancelled 409, refused 422, unavailable 503, timeout 504,
// disconnected and device_fault 502, storage and internal 500.
int http_status(ErrorCode code);

}  // namespace veneer::daemon
