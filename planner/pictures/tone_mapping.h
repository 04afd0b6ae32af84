// What becomes of a picture's tones before equation 2 maps them to the wood's (histogram.h): ours, not the paper's.
//
// Wood has few tones, and pieces show nothing that is smaller than they are. So what carries a face, eyes, mouth and
// the rim of a cheek, is set off from what surrounds it at the size of pieces, and a picture that is all pale or all
// dark uses the whole of the wood. Both keep the order of broad tones; ranks, which equation 2 matches, do not keep
// how far tones are apart, and make islands where a cheek hardly changes. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/units.h"
#include "planner/pictures/histogram.h"

namespace veneer::planner {

// CV_32FC1 in [0, 1]: what differs within two patches around is strengthened, by at most twice with `w_detail` 1; what
// is far smaller than a patch stays as it is.
cv::Mat set_off(const cv::Mat& grey, Pixels patch, double w_detail);

// Tones from the picture's darkest hundredth to its palest are laid evenly over the wood's, `w_range` of the way. A
// plain picture, or no wood: as it is.
cv::Mat stretch_tones(const cv::Mat& grey, const GreyHistogram& wood, double w_range);

}  // namespace veneer::planner
