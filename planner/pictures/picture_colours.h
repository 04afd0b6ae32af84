// What the numbers in a picture file mean as colours. The only door to lcms2. Pure; no function throws.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace veneer::planner {

// Grey or BGR of 8 or 16 bits to sRGB of the same depth and number of channels, relative colorimetric with black point
// compensation. None when the profile cannot be read or is not meant for such a picture.
std::optional<cv::Mat> to_srgb(const cv::Mat& picture, std::string_view icc_profile);

// Inks (CV_8UC4: cyan, magenta, yellow, black; 255 = full) to sRGB, CV_8UC3 BGR. Without a usable profile each ink
// takes its share of the light.
cv::Mat inks_to_srgb(const cv::Mat& cmyk, std::string_view icc_profile);

}  // namespace veneer::planner
