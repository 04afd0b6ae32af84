// Round things in a grey picture, measured by their own radial profile. Thread-safe.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace veneer::calib {

struct RoundFit {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // px, centres at +0.5
  double rim = 0;   // radius where the mean profile changes most, px; 0 when no rim is seen
  double rms = 0;   // how far the rim strays from the circle, px
  double seen = 0;  // fraction of the rays that agree
  bool brighter_inside = false;
};

struct RoundSearch {
  double rim_from = 0, rim_to = 0;  // radii between which the rim lies, px
  double inside = 0, outside = 0;   // how much of the profile within and beyond the rim counts, px
  double stray_limit = 0;           // a ray that strays farther does not agree, px
  double min_slope = 3;             // grey levels per pixel that are worth calling a rim
};

// Starts at `centre` and moves it until the profiles along all rays look alike, whatever they look like: a plain edge,
// or a shadow before the bright lid. The picture must hold the surroundings out to rim_to + outside.
RoundFit fit_round(const cv::Mat& grey, const Eigen::Vector2d& centre, const RoundSearch& search);

}  // namespace veneer::calib
