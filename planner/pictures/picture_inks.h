// Pictures made for print: the inks of CMYK files, which OpenCV would turn into colours without their profile. The only
// door to libjpeg and libtiff. Pure; no function throws.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace veneer::planner {

// CV_8UC4: cyan, magenta, yellow, black; 255 = full. Of a JPEG with four components, or a TIFF of inks with 8 or 16
// bits. None for any other file, and for one that is broken or stored in a rare way (tiles, separate planes).
std::optional<cv::Mat> read_inks(std::string_view bytes);

}  // namespace veneer::planner
