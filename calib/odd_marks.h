// What stands out from a strip of wood as nothing else on it does: round marks (holes, heads) and lines (cracks).
// A mark's contrast to its surroundings is measured by what is usual on the strip, so that bold wood needs bold marks
// and even wood shows faint ones, whatever their colours. Internal to veneer_mask. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"
#include "calib/round_rim.h"

namespace veneer::calib {

// How much rounds of about one size differ from the ring around them, over a strip.
class SpotContrast {
 public:
  // `box` bounds the strip, `strip` is 255 on it (both of the view's whole map); `radius` in mm.
  SpotContrast(const BoardView& view, const cv::Mat& strip, const cv::Rect& box, double radius);
  double radius() const { return radius_; }
  // CV_32FC1, as large as the box: 1 is the contrast that a few hundredths of the strip reach.
  const cv::Mat& oddness() const { return oddness_; }

 private:
  double radius_;
  cv::Mat oddness_;
};

// Rounds of 1 to 5 mm that differ from what lies around them on all sides, in the view's pixels.
std::vector<ScrewSpot> find_odd_spots(const BoardView& view, const cv::Mat& strip, const cv::Rect& box);

// 255 on lines along or across the strip that are far bolder than the grain; as large as the view's map.
cv::Mat find_odd_lines(const BoardView& view, const cv::Mat& strip, const cv::Rect& box);

}  // namespace veneer::calib
