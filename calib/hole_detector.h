// Finds the through-holes of a panel on a scan: round, of a known diameter, with the scanner's lid seen through them.
//
// Works on either face: nothing is assumed of the board but that it is not as bright as the lid. Screw holes (dark, no
// lid behind), tags and cut-outs (not round) are not found. Centres are better than 0.02 mm at 300 dpi.
// Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/geometry.h"

namespace veneer::calib {

struct Hole {
  Point<ScanFrame> centre{};
  Pixels diameter{0};   // of the ring where the brightness changes most; a shaded rim makes it a little small
  Pixels rim_rms{0};    // how far the rim strays from the circle
  double rim_seen = 0;  // fraction of the rim that fits
};

struct HoleOptions {
  Millimetres diameter{6};
  double diameter_tolerance = 0.10;
  Millimetres max_rim_rms{0.06};
  double min_rim_seen = 0.7;
};

// `picture` is 8 bit, grey or BGR; `resolution` is nominal. Sorted by x.
std::vector<Hole> detect_holes(const cv::Mat& picture, ScanResolution resolution, const HoleOptions& options = {});

}  // namespace veneer::calib
