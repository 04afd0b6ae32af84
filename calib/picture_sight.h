// Does a picture of the bed show anything? With the lamp off, something over the lens or a broken frame, that no tag is
// seen tells nothing of what lies there.
//
// Told by the pattern that every bed and every board has, which is finer than a tag's: where it shows, tags would.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::calib {

// The share of the picture (BGR or grey, 8 bit) in which a pattern of some pixels' width stands out from the noise.
double share_in_sight(const cv::Mat& picture);

// A picture with a smaller share may hide a panel's tags; one of an empty bed in workable light has a larger one.
inline constexpr double kLeastInSight = 0.25;

}  // namespace veneer::calib
