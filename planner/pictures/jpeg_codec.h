// The only door to libjpeg. Pure; does not throw.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace veneer::planner {

// The pixels as stored, neither turned nor converted by a profile: CV_8UC1 grey, CV_8UC3 BGR, or CV_8UC4 inks (cyan,
// magenta, yellow, black; 255 = full). None for what is no JPEG, and for one that is broken or of absurd size.
std::optional<cv::Mat> decode_jpeg(std::string_view bytes);

}  // namespace veneer::planner
