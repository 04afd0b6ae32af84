// Where a sheet is no longer what it was: change detection between two maps of it, whatever the colours of wood, board
// and lid. Internal; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

#include "calib/unchanged_look.h"

namespace veneer::calib {

struct WoodChange {
  cv::Mat gone;        // CV_8UC1, 255 where what was seen before is gone
  cv::Mat unlikeness;  // CV_8UC1: chi squared of three degrees of freedom, each pixel's own, what is above 255 as 255
};
// `now` is CV_8UC3, `booked` is 255 where a cut is expected; what is `marked` is not looked at.
WoodChange find_changes(const UnchangedLook& look, const cv::Mat& now, const cv::Mat& booked, const cv::Mat& marked,
                        double px_per_mm);

// Of what is booked and looks as it did, 255 where it was an opening already: what lay around it before is unlike it
// nearly all along its border. `before` is CV_8UC3; it is held against what is 255 in `beside` alone, the wood around
// it that is still there: of a border without any nothing is asked.
cv::Mat find_earlier_openings(const cv::Mat& before, const cv::Mat& alike, const cv::Mat& beside, double px_per_mm);

}  // namespace veneer::calib
