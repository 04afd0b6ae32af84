// The colour across a cut: samples finer than the pixels, and the model that is fitted to them. Private to calib.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/kerf_lines.h"
#include "calib/scan_light.h"

namespace veneer::calib {

// Mean colour against the distance from the line's middle, in bins; bins no pixel fell into have no weight.
struct SlitProfile {
  static constexpr double kReach = 1.0;  // mm to both sides
  static constexpr double kBin = 0.02;   // mm
  static constexpr int kBins = 100;

  std::array<std::array<double, 3>, kBins> colour{};
  std::array<double, kBins> place{};   // mm, mean of the pixels in the bin
  std::array<double, kBins> weight{};  // number of pixels
  std::array<double, 3> lid{};         // the scanner's lid beside the sheet
};

// What blurs and browns every slit of one direction alike.
struct SlitShape {
  LineSpread spread;        // of the scanner
  double roughness = 0.02;  // mm, sigma, of the burnt walls
  double rim = 0.10;        // mm, width of the browned wood beside the slit
  double soot = 0;          // mm, how far the smoke has settled beside it; 0 = none to be seen
};

struct SlitFit {
  double width = 0;     // mm
  double middle = 0;    // mm, against the profile's zero
  double residual = 0;  // rms, grey levels
  double lid = 0;       // how bright the lid looks through the slit, against beside the sheet
  double contrast = 0;  // largest difference of slit and rim or wood, grey levels
};

// The line moved onto the middle of the slit; `line` must be right to 0.3 mm and half a degree.
FoundLine centred_line(const cv::Mat& scan, ScanResolution resolution, const FoundLine& line);

// From the part [begin, end] of the line, as fractions of its length.
SlitProfile sample_profile(const cv::Mat& scan, ScanResolution resolution, const FoundLine& line, double begin,
                           double end, const std::array<double, 3>& lid);

// Width and middle with the shape given.
SlitFit fit_width(const SlitProfile& profile, const SlitShape& shape);

// The shape common to several profiles, each with its own width; the scanner's blur is known, the walls' roughness
// roughly.
SlitShape fit_shape(const std::vector<SlitProfile>& profiles, const ScanBlur& blur);

}  // namespace veneer::calib
