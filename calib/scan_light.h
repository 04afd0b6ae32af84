// What a scan tells of the scanner's own light and blur. Private to calib.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "base/units.h"

namespace veneer::calib {

// The brightest large thing on a scan, per channel: the lid. A usual one when the sheet covers the glass.
std::array<double, 3> lid_colour(const cv::Mat& scan);

struct ScanBlur {
  double sigma = 0;  // mm
  double trust = 0;  // relative, one sigma
};

// The blur at the sheet's edges against the lid; a usual one, little trusted, when no edge is to be seen.
ScanBlur scan_blur(const cv::Mat& scan, ScanResolution resolution, const std::array<double, 3>& lid);

}  // namespace veneer::calib
