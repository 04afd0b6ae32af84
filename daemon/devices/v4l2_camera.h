// A camera of Video4Linux over the bed: each picture is a worker process (daemon/orders/capture_work.h) that may open
// this camera and no other device, because drivers hang. One that hangs is killed at the deadline.
//
// Contract and threading: drivers/camera_driver.h.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "daemon/config.h"
#include "daemon/devices/found_devices.h"
#include "daemon/orders/capture_order.h"
#include "daemon/workers/work_folder.h"
#include "daemon/workers/work_runner.h"
#include "drivers/camera_driver.h"

namespace veneer::daemon {

class V4l2Camera final : public CameraDriver {
 public:
  // Twice what a look itself may take, for a machine that is busy.
  static constexpr std::chrono::seconds kDeadline{20};

  // Nothing is opened yet. `deadline` is for one picture, from the start of its process on.
  V4l2Camera(std::unique_ptr<WorkRunner> workers, CameraConfig config, std::filesystem::path data_dir,
             std::chrono::milliseconds deadline = kDeadline, DeviceRoots roots = {});

  Result<std::filesystem::path> capture() override;
  // Of one frame.
  Result<std::filesystem::path> glance(const std::stop_token& stop) override;
  // Its name as configured, size and format of its pictures, and all settings but those that are known to change
  // brightness and colours only.
  std::string device() const override;
  void give_up() noexcept override { given_up_.request_stop(); }

 private:
  Result<std::filesystem::path> take(int frames, std::optional<WorkFolder>& into, const std::stop_token& stop);

  std::unique_ptr<WorkRunner> workers_;
  CameraConfig config_;
  std::filesystem::path data_dir_;
  std::chrono::milliseconds deadline_;
  DeviceRoots roots_;
  std::stop_source given_up_;
  std::optional<WorkFolder> captured_, glanced_;  // the last of each
};

// An order to a worker process that may open these devices and nothing else.
WorkOrder camera_order(const char* kind, const char* what, const WorkFolder& folder,
                       std::vector<std::filesystem::path> devices, std::chrono::milliseconds deadline);
// kTimeout.
Error camera_hangs(const std::string& device, std::chrono::milliseconds deadline);

// A camera that is there and what it says of itself.
struct CameraToChoose {
  FoundCamera found;
  v4l2::DescribedCamera described;
};
// Every camera of this machine, whatever the cell is configured for. Blocks for seconds, ten at most, since looks at
// the bed wait meanwhile: on the camera's worker.
Result<std::vector<CameraToChoose>> find_cameras(WorkRunner& workers, const Config& config, const DeviceRoots& roots,
                                                 const TaskProgress& progress, const std::stop_token& stop);

}  // namespace veneer::daemon
