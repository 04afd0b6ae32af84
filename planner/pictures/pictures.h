// Pictures from files and uploads, brought to one form: CV_8UC3, BGR, sRGB, upright. No function throws.
//
// JPEG, PNG, TIFF, WebP, BMP, PNM and what else OpenCV reads; 1 to 16 bit whole numbers or floating point, grey,
// colour, palette, CMYK. The orientation a camera noted is applied, an embedded ICC profile is converted to sRGB, and
// what is transparent shows white, as on paper. CMYK without a profile is taken as plain multiplying inks.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::planner {

// kNotFound: no such file. kInvalidArgument: not a picture, or one that cannot be decoded.
Result<cv::Mat> load_picture(const std::filesystem::path& path);
// The same from bytes in memory (an upload); `name` stands in error messages.
Result<cv::Mat> decode_picture(std::string_view bytes, const std::string& name);
// CV_8UC3 too, of a picture whose values are not tones but tell areas apart, upright. What has more than 8 bits a value
// gets a colour for each value, whatever colour that is: as tones neighbouring labels would become one.
Result<cv::Mat> decode_labels(std::string_view bytes, const std::string& name);
// A scanner's picture, as CV_8UC3: its pixels lie as they are stored, whatever turn the file notes, since the scanner's
// map belongs to the glass and not to how a program would show the picture.
struct LoadedScan {
  cv::Mat pixels;
  double dpi_x = 0, dpi_y = 0;  // as the file says; 0: it does not
};
Result<LoadedScan> load_scan(const std::filesystem::path& path);
// CV_8UC1, 255 where the file is non-zero in any colour channel: upright, as its panel's picture is, but its numbers
// are as they are stored.
Result<cv::Mat> load_mask(const std::filesystem::path& path);

}  // namespace veneer::planner
