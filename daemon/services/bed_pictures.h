// The one way to pictures of the bed that prove anything: each is asked how old it is. A camera that reads files shows
// what somebody else put there, and goes on showing it when the program that takes the pictures hangs.
//
// Thread-safe but for take(), which belongs to the camera's worker.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>

#include "base/result.h"
#include "drivers/camera_driver.h"

namespace veneer::daemon {

class BedPictures {
 public:
  using WallTime = std::chrono::system_clock::time_point;
  // A picture that lets a beam begin is no older than this: hands may be at the bed until somebody says go.
  static constexpr std::chrono::seconds kOldest{60};
  enum class For {
    kPeople,     // proves nothing
    kMeasuring,  // what lies there since hands were last at the bed
    kBurning,    // what lies there now
  };
  struct Picture {
    std::filesystem::path file;
    Status fresh;  // kRefused when it is too old for what it was taken for, or says that it was taken in the future
    bool newer_may_come = false;  // it is too old
  };

  // `camera` outlives this. `now` is for tests.
  explicit BedPictures(CameraDriver& camera, std::function<WallTime()> now = &std::chrono::system_clock::now);

  // What was taken before proves nothing from here on (BedView::hands_were_in).
  void hands_were_in();
  WallTime hands_in() const;
  Result<Picture> take(For what) { return take(what, hands_in()); }
  // The same, of hands that were in until then only.
  Result<Picture> take(For what, WallTime hands_in);
  std::string device() const { return camera_.device(); }
  const CameraDriver& camera() const { return camera_; }

 private:
  Status check(For what, WallTime hands_in) const;

  CameraDriver& camera_;
  const std::function<WallTime()> now_;
  mutable std::mutex mutex_;
  WallTime hands_in_{};  // guarded by mutex_
};

}  // namespace veneer::daemon
