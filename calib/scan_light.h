// What a scan tells of the scanner's own light and blur. Private to calib.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "base/units.h"

namespace veneer::calib {

// The brightest large thing on a scan, per channel: the lid. A usual one when the sheet covers the glass.
std::array<double, 3> lid_colour(const cv::Mat& scan);

// How a scanner spreads the light of a line: two Gaussians about one middle, the second kWider times as wide. One alone
// is too simple for what is measured against it: optics and pixels together have a narrower core and longer tails.
struct LineSpread {
  static constexpr double kWider = 2;

  double sigma = 0.05;   // mm, of the narrower one
  double wide_part = 0;  // of the light; below 0: the scanner sharpens

  // The part of the light of a line at 0 that falls below x (mm), when what is seen is itself rough: `roughness` (mm,
  // sigma) is added to both.
  double below(double x, double roughness = 0) const;
  // Its integral (mm): what of the light that falls evenly on all from 0 on falls below x.
  double sum_below(double x, double roughness = 0) const;
};

struct ScanBlur {
  LineSpread spread;
  double trust = 0;  // mm, one sigma, of what a slit's walls may add
};

// The spread at the sheet's edges against the lid; a usual one, little trusted, when no edge is to be seen.
ScanBlur scan_blur(const cv::Mat& scan, ScanResolution resolution, const std::array<double, 3>& lid);

}  // namespace veneer::calib
