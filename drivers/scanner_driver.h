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
};

class ScannerDriver {
 public:
  virtual ~ScannerDriver() = default;
  // `progress` gets 0 to 1 and may be called from the calling thread only.
  virtual Result<ScanFile> scan(ScanResolution resolution, const std::function<void(double)>& progress,
                                std::stop_token stop) = 0;
  virtual std::string device() const = 0;
};

}  // namespace veneer
