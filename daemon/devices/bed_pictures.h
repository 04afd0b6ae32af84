// The one way to pictures of the bed that prove anything: each is asked how old it is. A camera that reads files shows
// what somebody else put there, and goes on showing it when the program that takes the pictures hangs. A camera that
// hangs itself gives one picture for ever, which is told by its content: no two pictures are alike to the last bit.
// Which one was seen last outlasts a restart, in a small file: it is a fact of the camera and of no use to a backup,
// and the database would keep a row of every look for good.
//
// Thread-safe but for take() and take_newer(), which belong to the camera's worker.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
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
    // kRefused when it is too old for what it was taken for, or says that it was taken in the future; kUnavailable when
    // it is the picture before once more.
    Status fresh;
    bool newer_may_come = false;  // it is too old, or that
    std::string sha256 = {};      // of the file; "" for people, and of one that cannot be read
  };

  // `camera` outlives this. `memory` is the file of the picture seen last; "": it is forgotten with this. A file that
  // cannot be read or written does no harm but that. `now` is for tests.
  explicit BedPictures(CameraDriver& camera, std::filesystem::path memory = {},
                       std::function<WallTime()> now = &std::chrono::system_clock::now);

  // What was taken before proves nothing from here on (BedView::hands_were_in).
  void hands_were_in();
  WallTime hands_in() const;
  Result<Picture> take(For what) { return take(what, hands_in()); }
  // The same, of hands that were in until then only.
  Result<Picture> take(For what, WallTime hands_in);
  // The same, waiting for so long for one that is fresh, where one may come. kCancelled soon after `stop`.
  Result<Picture> take_newer(For what, WallTime hands_in, std::chrono::milliseconds patience,
                             const std::stop_token& stop);
  // Was the picture that take_newer() gave last fresh? Ok() before the first.
  Status last_fresh() const;
  std::string device() const { return camera_.device(); }
  const CameraDriver& camera() const { return camera_; }

 private:
  Result<Picture> newest(For what, WallTime hands_in, std::chrono::milliseconds patience, const std::stop_token& stop);
  Status check(For what, WallTime hands_in) const;
  // Of what was taken last; notes it.
  bool is_repeated(const std::string& sha256);

  void recall();
  void remember() const;

  CameraDriver& camera_;
  const std::filesystem::path memory_;
  const std::function<WallTime()> now_;
  mutable std::mutex mutex_;
  WallTime hands_in_{};       // guarded by mutex_
  Status last_fresh_ = Ok();  // guarded by mutex_
  std::string last_sha256_;   // of the camera's worker, as is the next
  std::optional<WallTime> last_taken_;
};

}  // namespace veneer::daemon
