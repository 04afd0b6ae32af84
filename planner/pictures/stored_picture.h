// The pixels of a picture file of any format, as they are stored. Thread-safe; does not throw for broken files.
//
// JPEG, PNG and the inks of TIFF files by the libraries made for them; everything else by OpenCV's codecs. Those bring
// GDAL and a hundred other libraries, a tenth of a second at every start of the program, so they are loaded when the
// first file asks for them.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace veneer::planner {

struct StoredPicture {
  cv::Mat pixels;     // grey, grey with alpha, BGR or BGR with alpha, of any depth; or inks
  bool inks = false;  // CV_8UC4: cyan, magenta, yellow, black; 255 = full
};

// None for what is no picture, and for one that is broken or too large.
std::optional<StoredPicture> read_stored(std::string_view bytes);

}  // namespace veneer::planner
