// Pictures on disk, as the cell itself stores them. Blocks on the disk; thread-safe.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "base/raster.h"
#include "base/result.h"

namespace veneer::daemon {

// The resolution of every stored veneer map.
inline constexpr ScanResolution kMapResolution = ScanResolution::from_dpi(300);

// As stored: BGR or grey. kStorage when it cannot be read.
Result<cv::Mat> read_stored_picture(const std::filesystem::path& file);
// The same of a panel's map or mask, lying in its frame.
Result<Raster<PanelFrame>> read_stored_raster(const std::filesystem::path& file);
// Lossless (PNG), quickly rather than small: a scan's noise hardly compresses, and the operator waits. kStorage.
Status write_stored_picture(const cv::Mat& picture, const std::filesystem::path& file);

}  // namespace veneer::daemon
