// The only door to libjpeg. Pure; does not throw.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace veneer::planner {

// The pixels as stored, neither turned nor converted by a profile: CV_8UC1 grey, CV_8UC3 BGR, or CV_8UC4 inks (cyan,
// magenta, yellow, black; 255 = full). None for what is no JPEG, for one of absurd size, and for one that is broken in
// any way: where bytes are missing libjpeg would fill up with grey and only warn.
// With `only` also for one of another size, before a pixel of it is decoded.
std::optional<cv::Mat> decode_jpeg(std::string_view bytes, std::optional<cv::Size> only = std::nullopt);

// Of four pixels one colour is kept, and the brightness of each (4:2:0); or both of each (4:4:4), for lines a pixel
// wide.
enum class JpegColours { kOfFourPixels, kOfEachPixel };
// A JPEG file of a CV_8UC3 picture (BGR); `quality` is libjpeg's, 1 to 100.
std::optional<std::string> encode_jpeg(const cv::Mat& picture, int quality,
                                       JpegColours colours = JpegColours::kOfFourPixels);

}  // namespace veneer::planner
