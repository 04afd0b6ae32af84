// TIFF files: whether they are whole, which OpenCV does not ask, and the inks of those made for print, which it would
// turn into colours without their profile. The door to libtiff for pictures of people (the cell's own: tile_pyramid.h).
// Pure; does not throw.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace veneer::planner {

// Whether the first picture of the file unpacks to its last row without a complaint of the codec. OpenCV leaves out
// what does not and says nothing. Damage of what is not compressed nobody can tell.
bool tiff_is_whole(std::string_view bytes);

// CV_8UC4: cyan, magenta, yellow, black; 255 = full. Of 8 or 16 bits. None for a file without inks, and for one that is
// broken or stored in a rare way (tiles, separate planes).
std::optional<cv::Mat> tiff_inks(std::string_view bytes);

}  // namespace veneer::planner
