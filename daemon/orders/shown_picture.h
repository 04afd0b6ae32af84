// A picture for people, small enough for a screen, as a file. Thread-safe; does not throw.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <string>

#include "base/result.h"
#include "planner/pictures/jpeg_codec.h"

namespace veneer::daemon {

// `picture`: CV_8UC3 (BGR). As JPEG, at most `width` pixels wide. kStorage.
inline Status write_shown(const cv::Mat& picture, int width, const std::string& file) {
  cv::Mat small = picture;
  if (picture.cols > width)
    cv::resize(picture, small, {width, std::max(1, picture.rows * width / picture.cols)}, 0, 0, cv::INTER_AREA);
  constexpr int kQuality = 85;
  if (const auto bytes = planner::encode_jpeg(small, kQuality)) {
    std::ofstream out(file, std::ios::binary);
    if (out.write(bytes->data(), static_cast<std::streamsize>(bytes->size())).flush()) return Ok();
  }
  return Error{ErrorCode::kStorage, fmt::format("cannot write {}: make room on the disk, then try again", file)};
}

}  // namespace veneer::daemon
