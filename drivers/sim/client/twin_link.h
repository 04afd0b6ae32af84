// The cell's end of the twin's socket: JSON lines over a Unix stream socket, one object per line each way.
//
// Threading: request() blocks; one request at a time, a new connection each. Any thread, but not the reactor.
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>

#include "base/result.h"

namespace veneer::sim {

class TwinLink {
 public:
  explicit TwinLink(std::string socket_path, std::chrono::milliseconds timeout = std::chrono::seconds(60));
  // The reply of the twin. kUnavailable when no twin listens, kCancelled on stop, kTimeout when it stays silent; the
  // twin's own refusals come back with its code and sentence.
  Result<nlohmann::json> request(const nlohmann::json& command, const std::stop_token& stop = {}) const;
  const std::string& socket_path() const { return socket_path_; }

 private:
  std::string socket_path_;
  std::chrono::milliseconds timeout_;
};

}  // namespace veneer::sim
