// The only door to libpng. Pure; does not throw.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace veneer::planner {

// The pixels as stored, neither turned nor converted by a profile: 8 or 16 bits; grey, grey with alpha, BGR or BGR with
// alpha. Palettes and fewer bits are spread out. None for what is no PNG, and for one that is broken.
std::optional<cv::Mat> decode_png(std::string_view bytes);

// A PNG file of a CV_8UC3 picture (BGR), a CV_8UC4 one (with alpha) or a CV_8UC1 one, packed quickly rather than
// tightly.
std::optional<std::string> encode_png(const cv::Mat& picture);

// The same of a mask, CV_8UC1, in one bit a pixel: zero is black, all else white. Read back it is 0 and 255.
std::optional<std::string> encode_png_mask(const cv::Mat& mask);

}  // namespace veneer::planner
