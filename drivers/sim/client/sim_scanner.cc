#include "drivers/sim/client/sim_scanner.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace veneer::sim {

SimScanner::SimScanner(std::string socket_path) : link_(std::move(socket_path)) {}

Result<ScanFile> SimScanner::scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) {
  if (progress) progress(0, "");
  const Result<nlohmann::json> reply =
      link_.request({{"cmd", "scan"}, {"dpi", std::round(resolution.dpi() * 100) / 100}}, stop);
  if (!reply.ok()) return reply.error();
  ScanFile image;
  try {
    image.file = reply->at("file").get<std::string>();
    image.nominal = ScanResolution::from_dpi(reply->at("dpi").get<double>());
    image.device = "twin:" + reply->at("capture").get<std::string>();
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kDeviceFault, fmt::format("the twin's answer to a scan makes no sense: {}", e.what())};
  }
  if (progress) progress(1, "");
  return image;
}

}  // namespace veneer::sim
