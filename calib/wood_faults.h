// What lies in a strip of veneer and is no wood of it: screws of any metal, holes, cracks, openings. Internal to
// veneer_mask. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"
#include "calib/round_rim.h"

namespace veneer::calib {

struct WoodFaults {
  cv::Mat mask;                  // CV_8UC1, 255 = not the strip's wood
  std::vector<ScrewSpot> round;  // screws and holes, in the view's pixels
};

// `strip` is 255 on one strip. A colour is its wood's own when it is seen all over the strip; what is far from every
// such colour and off the line of the wood's pigment, and more than a speck, is a fault. Round is what ends at a rim: a
// knot fades into its wood and belongs to it.
WoodFaults find_faults(const BoardView& view, const cv::Mat& strip);

}  // namespace veneer::calib
