// One flatbed scanner.
//
// Threading: scan() blocks (seconds to minutes) and is called from the scanner's own worker, never from the reactor.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "base/units.h"

namespace veneer {

// One raw raster: BGR, 8 bit, ScanFrame (y down, pixel centres at +0.5), as the device delivered it.
struct ScanImage {
  cv::Mat pixels;
  ScanResolution nominal;  // what the device claims; the certificate knows better
  std::string device;
};

class ScannerDriver {
 public:
  virtual ~ScannerDriver() = default;
  // `progress` gets 0 to 1 and may be called from the calling thread only.
  virtual Result<ScanImage> scan(ScanResolution resolution, const std::function<void(double)>& progress,
                                 std::stop_token stop) = 0;
  virtual std::string device() const = 0;
};

}  // namespace veneer
