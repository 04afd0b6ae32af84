#include "daemon/orders/stored_picture.h"

#include <fmt/format.h>

#include <fstream>
#include <string>

#include "base/files.h"
#include "planner/pictures/png_codec.h"

namespace veneer::daemon {

Result<cv::Mat> read_stored_picture(const std::filesystem::path& file) {
  std::error_code failed;
  if (std::filesystem::is_regular_file(file, failed))  // of a pipe it would wait for a writer
    if (const auto bytes = read_whole(file))
      if (auto picture = planner::decode_png(*bytes)) return *picture;
  return Error{ErrorCode::kStorage,
               fmt::format("cannot read {}: restore it from a backup or scan the panel again", file.string())};
}

Result<Raster<PanelFrame>> read_stored_raster(const std::filesystem::path& file) {
  auto pixels = read_stored_picture(file);
  if (!pixels) return pixels.error();
  return Raster<PanelFrame>{*pixels, kMapResolution, {}};
}

Status write_stored_picture(const cv::Mat& picture, const std::filesystem::path& file) {
  if (const auto bytes = planner::encode_png(picture)) {
    std::ofstream out(file, std::ios::binary);
    if (out.write(bytes->data(), static_cast<std::streamsize>(bytes->size())).flush()) return Ok();
  }
  return Error{ErrorCode::kStorage,
               fmt::format("cannot write {}: make room on the disk, then try again", file.string())};
}

}  // namespace veneer::daemon
