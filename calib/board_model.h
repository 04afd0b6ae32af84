// The board that veneer is glued on, learnt from the rim of the map itself, and the map as seen against it.
// Internal to veneer_mask. Thread-safe.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "calib/work_map.h"

namespace veneer::calib {

constexpr double kScannerBlack = 8;  // grey levels added before a logarithm is taken

// A map in logarithms, so that light and shade add: lightness, and two opponent colours (red less green, green less
// blue). Zero is the board in its own light; the unit is the board's own spread, `spread` of which is one logarithm.
struct BoardView {
  std::array<cv::Mat, 3> planes;   // CV_32FC1, natural logarithms, light evened out
  std::array<double, 3> spread{};  // of the board at its rim, about 0.3 mm wide places
  // What zero is: the board in the middle of the map, as the scanner saw it. A colour is grey when its opponent colours
  // and the board's come to nothing together.
  std::array<double, 3> board{};
  double px_per_mm = 0;
  double level = 255;    // of the board at its rim, mean of the channels, the scanner's own black included
  double rim_share = 0;  // of the rim, how much shows one material: below a half the board is not known
  cv::Mat black;         // CV_8UC1, 255 where the scanner sees nothing: darker than any wood that is lit; or empty
  cv::Mat unlike;        // CV_32FC1, one pixel a millimetre: how unlike the board each place is, in its spreads
};

// `fiducials` is 255 where tags and holes are.
BoardView view_board(const WorkMap& work, const cv::Mat& fiducials);

}  // namespace veneer::calib
