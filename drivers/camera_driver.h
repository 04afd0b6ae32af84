// The camera over the laser bed.
//
// Threading: capture() blocks (up to a few seconds) and is called from the camera's own worker, never from the reactor.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"

namespace veneer {

class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  // A fresh image, BGR, 8 bit, CameraFrame (y down, pixel centres at +0.5). Never a stale one.
  virtual Result<cv::Mat> capture() = 0;
  virtual std::string device() const = 0;
};

}  // namespace veneer
