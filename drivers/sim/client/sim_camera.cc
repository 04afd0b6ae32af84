#include "drivers/sim/client/sim_camera.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>

namespace veneer::sim {

SimCamera::SimCamera(std::string socket_path) : link_(std::move(socket_path)) {}

Result<cv::Mat> SimCamera::capture() {
  const Result<nlohmann::json> reply = link_.request({{"cmd", "camera"}});
  if (!reply.ok()) return reply.error();
  try {
    const auto file = reply->at("file").get<std::string>();
    cv::Mat picture = cv::imread(file, cv::IMREAD_COLOR);
    if (picture.empty()) {
      return Error{ErrorCode::kDeviceFault, fmt::format("the camera picture {} of the twin cannot be read", file)};
    }
    return picture;
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kDeviceFault, fmt::format("the twin's answer to a capture makes no sense: {}", e.what())};
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kDeviceFault, fmt::format("the twin's camera picture cannot be read: {}", e.err)};
  }
}

}  // namespace veneer::sim
