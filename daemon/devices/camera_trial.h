// A camera of this computer tried before it is chosen: what to write for it, and the picture that this makes.
//
// What is chosen is what somebody could see: the figures of a choice are those of the last trial, so that no camera is
// chosen that gives no picture, cannot be locked or is set so that nothing can be seen.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "daemon/config.h"
#include "daemon/devices/found_devices.h"
#include "daemon/orders/capture_order.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct CameraTrial {
  std::int64_t task = 0;  // that made it
  CameraConfig camera;    // as the configuration would have it
  std::vector<v4l2::LookDoubt> doubts;
  std::string jpeg;  // for people
};

// Whose turn it is to try or look for cameras; over at the latest when nobody holds it any more. Any thread.
class CameraTurn {
 public:
  explicit CameraTurn(std::shared_ptr<std::atomic<bool>> taken) : taken_(std::move(taken)) {}
  ~CameraTurn() { end(); }
  CameraTurn(const CameraTurn&) = delete;
  CameraTurn& operator=(const CameraTurn&) = delete;
  void end() {
    if (!ended_.exchange(true)) *taken_ = false;
  }

 private:
  const std::shared_ptr<std::atomic<bool>> taken_;
  std::atomic<bool> ended_ = false;
};

// The last trial since the daemon began, and one at a time. Thread-safe.
class CameraTrials {
 public:
  // kConflict while another one is waited for or under way: a run that begins meanwhile would wait for them all.
  Result<std::shared_ptr<CameraTurn>> take_turn() {
    if (!taken_->exchange(true)) return std::make_shared<CameraTurn>(taken_);
    return Error{ErrorCode::kConflict,
                 "a camera is tried or looked for already: wait until that is done, then try again"};
  }
  void keep(CameraTrial trial) {
    auto kept = std::make_shared<const CameraTrial>(std::move(trial));
    const std::lock_guard lock(mutex_);
    last_ = std::move(kept);
  }
  // Null before the first.
  std::shared_ptr<const CameraTrial> last() const {
    const std::lock_guard lock(mutex_);
    return last_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const CameraTrial> last_;  // guarded by mutex_
  const std::shared_ptr<std::atomic<bool>> taken_ = std::make_shared<std::atomic<bool>>(false);
};

// What somebody wants to see: of a camera by its lasting name, at a size and in a format or else at those that suit it
// best, with these settings or else with what its own automatics come to.
struct WantedTrial {
  std::string device;
  int width = 0, height = 0;  // both 0: the best
  std::string format;         // "": the best of that size
  v4l2::StatedControls settings;
};

// Only what udev names as a camera is opened, by a name that lasts: kNotFound; kRefused when that name means several.
// Any thread that may wait for a disk, as the next.
Status may_be_tried(const DeviceRoots& roots, const std::string& device);
// kNotFound when no camera of that name is plugged in now.
Status is_plugged_in(const DeviceRoots& roots, const std::string& device);
// Blocks for some 5 s, 40 at most, since looks at the bed wait meanwhile: on the camera's worker.
Result<CameraTrial> try_camera(WorkRunner& workers, const Config& config, const DeviceRoots& roots,
                               const WantedTrial& wanted, const TaskProgress& progress, const std::stop_token& stop);

}  // namespace veneer::daemon
