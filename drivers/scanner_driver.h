// One flatbed scanner.
//
// A driver hands over files and never looks into them: pictures are foreign data, and are decoded where a fault costs
// nothing else (daemon/workers).
//
// Threading: scan() blocks (seconds to minutes) and is called from the scanner's own worker, never from the reactor.
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "base/units.h"

namespace veneer {

// One raw raster in ScanFrame (y down, pixel centres at +0.5), as the device delivered it: a picture file, which stays
// where it is at least until the next scan.
struct ScanFile {
  std::filesystem::path file;
  ScanResolution nominal;  // what the device claims; the certificate knows better
  std::string device;
  std::string make;  // of the device that scanned, "EPSON Perfection V39"; "" where that is not known
};

// 0 to 1, and what the device does instead of scanning, as warming up; "" while it scans.
using ScanProgress = std::function<void(double fraction, const std::string& doing)>;

class ScannerDriver {
 public:
  virtual ~ScannerDriver() = default;
  // `progress` is called on the calling thread only.
  virtual Result<ScanFile> scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) = 0;
  // What certificates are bound to: always the same, also before the device is reached for the first time.
  virtual std::string device() const = 0;
};

}  // namespace veneer
