#include "drivers/file/file_camera.h"

#include <utility>

namespace veneer {

FileCamera::FileCamera(std::string device) : pictures_(std::move(device)) {}

Result<std::filesystem::path> FileCamera::capture() {
  auto picture = pictures_.next();
  if (!picture.ok()) return picture.error();
  taken_at_ = picture->written;
  return std::move(picture->file);
}

std::string FileCamera::device() const { return "file:" + pictures_.pattern(); }

}  // namespace veneer
