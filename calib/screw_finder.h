// Finds screw holes in veneer: dark and round, in wood of any shade. Internal to veneer_mask. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/veneer_mask.h"

namespace veneer::calib {

struct ScrewSpot {
  cv::Point2d centre;  // px, centres at +0.5
  double diameter = 0;
};

// `bgr` at `px_per_mm` (about 6); `wood` is 255 where veneer may be.
std::vector<ScrewSpot> find_screws(const cv::Mat& bgr, const cv::Mat& wood, double px_per_mm,
                                   const MaskOptions& options);

}  // namespace veneer::calib
