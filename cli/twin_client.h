// A client of the twin's socket: one JSON object per line each way. Blocking.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"

namespace veneer::cli {

class TwinClient {
 public:
  explicit TwinClient(std::string socket_path, std::chrono::seconds timeout = std::chrono::seconds(60))
      : socket_path_(std::move(socket_path)), timeout_(timeout) {}

  // Sends {"cmd": cmd, ...arguments}; the twin's refusals come back as their own ErrorCode and sentence.
  Result<nlohmann::json> call(const std::string& cmd, const nlohmann::json& arguments = nlohmann::json::object()) const;

 private:
  std::string socket_path_;
  std::chrono::seconds timeout_;
};

}  // namespace veneer::cli
