#include "daemon/orders/stored_picture.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>

namespace veneer::daemon {

Result<cv::Mat> read_stored_picture(const std::filesystem::path& file) {
  cv::Mat picture = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (picture.empty())
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot read {}: restore it from a backup or scan the panel again", file.string())};
  return picture;
}

Result<Raster<PanelFrame>> read_stored_raster(const std::filesystem::path& file) {
  auto pixels = read_stored_picture(file);
  if (!pixels) return pixels.error();
  return Raster<PanelFrame>{*pixels, kMapResolution, {}};
}

Status write_stored_picture(const cv::Mat& picture, const std::filesystem::path& file) {
  if (cv::imwrite(file.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 1})) return Ok();
  return Error{ErrorCode::kStorage,
               fmt::format("cannot write {}: make room on the disk, then try again", file.string())};
}

}  // namespace veneer::daemon
