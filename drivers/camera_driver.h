// The camera over the laser bed.
//
// Threading: capture() blocks (up to a few seconds) and is called from the camera's own worker, never from the reactor.
#pragma once

#include <chrono>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "base/result.h"

namespace veneer {

class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  // A fresh image, BGR, 8 bit, CameraFrame (y down, pixel centres at +0.5). Never a stale one.
  virtual Result<cv::Mat> capture() = 0;
  // When the last picture was taken, of a camera that cannot take one when it is asked: somebody else puts it there,
  // and who asks must look how old it is. Nothing when it was taken by capture().
  virtual std::optional<std::chrono::system_clock::time_point> taken_at() const { return std::nullopt; }
  virtual std::string device() const = 0;
};

}  // namespace veneer
