// A scanner that SANE knows, as the cell sees it: each scan is a worker process (daemon/orders/capture_work.h), because
// backends hang and crash. One that hangs is told to end at the deadline, and killed soon after.
//
// Contract and threading: drivers/scanner_driver.h.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "daemon/config.h"
#include "daemon/orders/capture_order.h"
#include "daemon/workers/work_folder.h"
#include "daemon/workers/work_runner.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

class SaneScanner final : public ScannerDriver {
 public:
  // Nothing is opened yet. What is at `laser_port` (LaserConfig::port) its workers may not open. `deadline` is for one
  // scan, from looking for the device on.
  SaneScanner(std::unique_ptr<WorkRunner> workers, ScannerConfig config, std::string laser_port,
              std::filesystem::path data_dir, std::chrono::milliseconds deadline);

  Result<ScanFile> scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) override;
  // Its name or make as configured, and what of the settings changes where a point of the glass is seen.
  std::string device() const override;

 private:
  std::unique_ptr<WorkRunner> workers_;
  ScannerConfig config_;
  std::string laser_port_;
  std::filesystem::path data_dir_;
  std::chrono::milliseconds deadline_;
  std::optional<WorkFolder> folder_;  // of the last scan
};

// Every scanner that SANE finds, whatever the cell is configured for. Blocks for seconds: on the scanner's worker.
Result<ScannersFound> find_scanners(WorkRunner& workers, const Config& config, const TaskProgress& progress,
                                    const std::stop_token& stop);

}  // namespace veneer::daemon
