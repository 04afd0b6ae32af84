// The camera over the laser bed.
//
// A driver hands over files and never looks into them (drivers/scanner_driver.h).
//
// Threading: capture() and glance() block (up to a few seconds) and are called from the camera's own worker, never from
// the reactor; give_up() while one of them runs.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"

namespace veneer {

class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  // A fresh picture in CameraFrame (y down, pixel centres at +0.5), as a file that stays where it is at least until the
  // next capture. Never a stale one.
  virtual Result<std::filesystem::path> capture() = 0;
  // A picture for somebody who only watches; it proves nothing. Of pictures that are handed out in turn it takes none
  // away from the captures to come, it may be smaller, and where the device can it ends at a stop request (kCancelled).
  virtual Result<std::filesystem::path> glance(const std::stop_token& stop) {
    static_cast<void>(stop);
    return capture();
  }
  // When the last picture was taken, of a camera that cannot take one when it is asked: somebody else puts it there,
  // and who asks must look how old it is. Nothing when it was taken by capture().
  virtual std::optional<std::chrono::system_clock::time_point> taken_at() const { return std::nullopt; }
  virtual std::string device() const = 0;
  // For the end of the program, which must not wait for a device that hangs: where the device can, it ends what is
  // under way and refuses all that comes later (kCancelled). Any thread.
  virtual void give_up() noexcept {}
};

}  // namespace veneer
