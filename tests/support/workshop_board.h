// The boards that a workshop glues its veneers on.
#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace veneer::workshop {

// A board of `size` at `px` pixels for a millimetre, as floating BGR, and its name.
cv::Mat paint_board(int board, cv::Size size, double px, cv::RNG& random, std::string& name);

}  // namespace veneer::workshop
