// The simulated bed camera as the cell sees it: a CameraDriver that asks the twin's process for a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "drivers/camera_driver.h"
#include "drivers/sim/client/twin_link.h"

namespace veneer::sim {

class SimCamera final : public CameraDriver {
 public:
  explicit SimCamera(std::string socket_path);
  Result<std::filesystem::path> capture() override;
  Result<std::filesystem::path> glance(const std::stop_token& stop) override;
  std::string device() const override { return "twin:camera"; }

 private:
  Result<std::filesystem::path> ask(const nlohmann::json& command, const std::stop_token& stop = {});

  TwinLink link_;
};

}  // namespace veneer::sim
