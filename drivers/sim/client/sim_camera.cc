#include "drivers/sim/client/sim_camera.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace veneer::sim {

SimCamera::SimCamera(std::string socket_path) : link_(std::move(socket_path)) {}

Result<std::filesystem::path> SimCamera::capture() { return ask({{"cmd", "camera"}}); }

Result<std::filesystem::path> SimCamera::glance(const std::stop_token& stop) {
  return ask({{"cmd", "camera"}, {"glance", true}}, stop);
}

Result<std::filesystem::path> SimCamera::ask(const nlohmann::json& command, const std::stop_token& stop) {
  const Result<nlohmann::json> reply = link_.request(command, stop);
  if (!reply.ok()) return reply.error();
  try {
    return std::filesystem::path(reply->at("file").get<std::string>());
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kDeviceFault, fmt::format("the twin's answer to a capture makes no sense: {}", e.what())};
  }
}

}  // namespace veneer::sim
