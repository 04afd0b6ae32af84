// The simulated scanner as the cell sees it: a ScannerDriver that asks the twin's process for a scan.
#pragma once

#include <string>

#include "drivers/scanner_driver.h"
#include "drivers/sim/client/twin_link.h"

namespace veneer::sim {

class SimScanner final : public ScannerDriver {
 public:
  explicit SimScanner(std::string socket_path);
  // ScanFile::device is "twin:capture-N". Cancels within 100 ms of a stop request. Works at 75 to 600 dpi.
  Result<ScanFile> scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) override;
  std::string device() const override { return "twin"; }

 private:
  TwinLink link_;
};

}  // namespace veneer::sim
