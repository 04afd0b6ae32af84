// An open camera: what it is, what can be set, its frames. Closed with the object. The real one is video_device.h's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/v4l2/camera_control.h"
#include "drivers/v4l2/frame_source.h"

namespace veneer::v4l2 {

// A way of pictures that a device offers. One size, or all from the least to the most in steps.
struct OfferedFormat {
  std::string code;  // "YUYV"
  int width = 0, height = 0;
  int most_width = 0, most_height = 0, step_width = 1, step_height = 1;  // most = least: that size only
  bool has(int w, int h) const {
    return w >= width && w <= most_width && h >= height && h <= most_height && (w - width) % step_width == 0 &&
           (h - height) % step_height == 0;
  }
};

class OpenCamera : public FrameSource {
 public:
  virtual std::string card() const = 0;  // what it calls itself: "HD Pro Webcam C920"
  virtual std::string bus() const = 0;   // where it is plugged in: "usb-0000:00:14.0-1"
  virtual Result<std::vector<OfferedFormat>> formats() = 0;
  // What the device made of it, which may be another.
  virtual Result<FrameFormat> set_format(const std::string& code, int width, int height) = 0;
  // As they stand now; each set may change others.
  virtual Result<std::vector<CameraControl>> controls() = 0;
  virtual Status set(const CameraControl& control, std::int64_t value) = 0;
};

}  // namespace veneer::v4l2
