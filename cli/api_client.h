// A client of the daemon's API: veneerctl, the demo and the scenario tests speak through it and through nothing else.
//
// Blocking, one connection per request; one instance per thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace veneer::cli {

struct ApiAddress {
  std::string unix_path;           // used when not empty
  std::string host = "127.0.0.1";  // otherwise
  int port = 0;
  bool tls = false;            // the host's certificate is believed by `authority`, or else by the system
  std::string authority = {};  // a PEM file; "" = none
  // Of a session or token, sent with every request; "" = none. With one nothing is sent in clear text to other
  // machines.
  std::string secret = {};
};

// Through TLS, or within this machine: bytes as they are may be read by anybody on their way.
bool may_carry_secret(const ApiAddress& address);

struct ApiResponse {
  int status = 0;
  std::string content_type;
  std::string body;
  std::optional<std::int64_t> age_s = {};  // of what the cell has had for a while (Age)
};

struct SentPicture {
  std::string bytes;
  std::optional<std::int64_t> age_s;
};

class ApiClient {
 public:
  explicit ApiClient(ApiAddress address, std::chrono::milliseconds timeout = std::chrono::seconds(60))
      : address_(std::move(address)), timeout_(timeout) {}

  // The daemon's errors come back as their own ErrorCode and message; kUnavailable when nobody listens.
  // `target` is a path below /api/v1, with its query: "/jobs?name=Grace". What changes something goes out with a key of
  // its own (Idempotency-Key) and is sent once more when the daemon hung up over it: it is done once.
  Result<nlohmann::json> get(const std::string& target) const { return request("GET", target, "", ""); }
  // A long list that comes in pages, whole: the first page's reply with all that follow in its `list`.
  Result<nlohmann::json> get_all(const std::string& target, const std::string& list) const;
  Result<nlohmann::json> post(const std::string& target, const nlohmann::json& body = nlohmann::json::object()) const;
  Result<nlohmann::json> request(const std::string& method, const std::string& target, const std::string& body,
                                 const std::string& content_type) const;
  // A picture or another file.
  Result<std::string> get_bytes(const std::string& target) const;
  Result<SentPicture> get_picture(const std::string& target) const;
  // Whatever came back, also with an error status; `path` is whole ("/api/v1/...", "/console"). For tests.
  Result<ApiResponse> raw(const std::string& method, const std::string& path, const std::string& body,
                          const std::string& content_type,
                          const std::vector<std::pair<std::string, std::string>>& headers = {}) const;

  // Polls until the task is over and returns its "result"; a failed one is its error. `on_progress` gets the task's
  // JSON every time it was looked at; returning false cancels the task (-> kCancelled once it has ended).
  using OnProgress = std::function<bool(const nlohmann::json& task)>;
  Result<nlohmann::json> wait_task(std::int64_t task, const OnProgress& on_progress = {}) const;
  // post() of long work and wait_task() of the task it answers.
  Result<nlohmann::json> post_and_wait(const std::string& target, const nlohmann::json& body = nlohmann::json::object(),
                                       const OnProgress& on_progress = {}) const;

  const ApiAddress& address() const { return address_; }

 private:
  ApiAddress address_;
  std::chrono::milliseconds timeout_;
};

// For a query: "a b&c" -> "a%20b%26c".
std::string url_encode(std::string_view text);

}  // namespace veneer::cli
