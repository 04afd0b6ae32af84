#include "drivers/file/file_camera.h"

#include <utility>

namespace veneer {

FileCamera::FileCamera(std::string device) : pictures_(std::move(device)) {}

Result<std::filesystem::path> FileCamera::capture() { return given(pictures_.next()); }

Result<std::filesystem::path> FileCamera::glance(const std::stop_token& /*stop*/) { return given(pictures_.peek()); }

Result<std::filesystem::path> FileCamera::given(Result<NamedPicture> picture) {
  if (!picture.ok()) return picture.error();
  taken_at_ = picture->written;
  return std::move(picture->file);
}

std::string FileCamera::device() const { return "file:" + pictures_.pattern(); }

}  // namespace veneer
