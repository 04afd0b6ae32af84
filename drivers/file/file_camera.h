// Pictures from disk as a camera: each capture gives the next one, read at that moment.
//
// Contract and threading: drivers/camera_driver.h.
#pragma once

#include "drivers/camera_driver.h"
#include "drivers/file/picture_source.h"

namespace veneer {

class FileCamera final : public CameraDriver {
 public:
  explicit FileCamera(std::string device);  // as PictureSource takes it

  Result<std::filesystem::path> capture() override;
  Result<std::filesystem::path> glance(const std::stop_token& stop) override;
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return taken_at_; }
  std::string device() const override;

 private:
  Result<std::filesystem::path> given(Result<NamedPicture> picture);

  PictureSource pictures_;
  std::optional<std::chrono::system_clock::time_point> taken_at_;
};

}  // namespace veneer
