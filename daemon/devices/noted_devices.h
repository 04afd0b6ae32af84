// Camera and scanner that note how they were when they were asked last, whoever asked: a look, a glance, a calibration.
//
// Threading: as drivers/camera_driver.h and drivers/scanner_driver.h say; last() is thread-safe.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "drivers/camera_driver.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

// How the last one ended; nothing when none was taken since the program began.
struct DeviceNote {
  std::optional<std::chrono::system_clock::time_point> at;  // when the picture was taken, or was to be
  std::chrono::system_clock::duration behind{0};            // so old it was already when it was asked for
  Status outcome = Ok();
};

class NotedDevice {
 public:
  DeviceNote last() const {
    const std::lock_guard lock(mutex_);
    return note_;
  }

 protected:
  // What somebody broke off says nothing of the device.
  template <class T>
  void note(const Result<T>& outcome, std::optional<std::chrono::system_clock::time_point> taken_at = {}) {
    const auto now = std::chrono::system_clock::now();
    const auto at = taken_at.value_or(now);
    if (!outcome && outcome.error().code == ErrorCode::kCancelled) return;
    const std::lock_guard lock(mutex_);
    note_ = {at, now - at, outcome ? Ok() : Status(outcome.error())};
  }

 private:
  mutable std::mutex mutex_;
  DeviceNote note_;  // guarded by mutex_
};

class NotedCamera final : public CameraDriver, public NotedDevice {
 public:
  explicit NotedCamera(std::unique_ptr<CameraDriver> camera) : camera_(std::move(camera)) {}

  Result<std::filesystem::path> capture() override { return noted(camera_->capture()); }
  Result<std::filesystem::path> glance(const std::stop_token& stop) override { return noted(camera_->glance(stop)); }
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return camera_->taken_at(); }
  std::string device() const override { return camera_->device(); }
  void give_up() noexcept override { camera_->give_up(); }

 private:
  Result<std::filesystem::path> noted(Result<std::filesystem::path> picture) {
    note(picture, picture ? camera_->taken_at() : std::nullopt);
    return picture;
  }
  std::unique_ptr<CameraDriver> camera_;
};

class NotedScanner final : public ScannerDriver, public NotedDevice {
 public:
  explicit NotedScanner(std::unique_ptr<ScannerDriver> scanner) : scanner_(std::move(scanner)) {}

  Result<ScanFile> scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) override {
    auto file = scanner_->scan(resolution, progress, std::move(stop));
    note(file);
    return file;
  }
  std::string device() const override { return scanner_->device(); }

 private:
  std::unique_ptr<ScannerDriver> scanner_;
};

}  // namespace veneer::daemon
