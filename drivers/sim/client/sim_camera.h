// The simulated bed camera as the cell sees it: a CameraDriver that asks the twin's process for a picture.
#pragma once

#include <string>

#include "drivers/camera_driver.h"
#include "drivers/sim/client/twin_link.h"

namespace veneer::sim {

class SimCamera final : public CameraDriver {
 public:
  explicit SimCamera(std::string socket_path);
  Result<std::filesystem::path> capture() override;
  std::string device() const override { return "twin:camera"; }

 private:
  TwinLink link_;
};

}  // namespace veneer::sim
