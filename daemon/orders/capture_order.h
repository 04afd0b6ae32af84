// What a worker process is asked to do with scanners, and what it answers. Pure; the doing is capture_work.h's, so that
// whoever orders need not link SANE.
#pragma once

#include <string>
#include <vector>

#include "drivers/sane/scan_order.h"

namespace veneer::daemon {

// One picture of what lies on the glass; it becomes kMadeCapture in the work's folder.
struct ScanGlass {
  static constexpr const char* kKind = "scan_glass";
  std::string sane_config;  // SANE's folder of settings; "": the system's
  sane::ScanSettings settings;
};
inline constexpr const char* kMadeCapture = "capture.pnm";

// Every scanner there is, with what can be set on it.
struct FindScanners {
  static constexpr const char* kKind = "find_scanners";
  std::string sane_config;
};
struct ScannersFound {
  std::vector<sane::DescribedScanner> scanners;
};

}  // namespace veneer::daemon
