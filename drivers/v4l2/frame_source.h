// Frames of a camera, one after the other, as its driver hands them out: nothing of them is believed yet.
//
// Threading: one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace veneer::v4l2 {

// How the bytes of a frame are to be read.
struct FrameFormat {
  std::string code;  // four letters, as the kernel writes them: "YUYV", "MJPG"
  int width = 0, height = 0;
  int bytes_per_line = 0;        // of the first plane; 0: of a compressed format
  bool full_range = false;       // of luma and chroma: 0 to 255 rather than 16 to 235 or 240
  bool high_definition = false;  // BT.709's luma rather than BT.601's
};

struct Frame {
  std::vector<std::uint8_t> bytes;
  // When the driver says that it was exposed: its begin or its end, whichever the driver stamps. Nothing where that is
  // not said by the clock that this machine measures time with.
  std::optional<TimePoint> taken;
  bool damaged = false;  // the driver says so
};

// An open camera, set as wanted.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const std::string& camera() const = 0;  // for sentences
  virtual Status start() = 0;
  // Blocks for `wait` at most; nothing when no frame came. kUnavailable: the camera is gone; kDeviceFault: it cannot be
  // read.
  virtual Result<std::optional<Frame>> next(Duration wait) = 0;
  virtual void end() noexcept = 0;
};

}  // namespace veneer::v4l2
