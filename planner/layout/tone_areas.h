// An automatic segmentation: the areas of a picture that are of about one tone, as a poster or a marquetry has them.
//
// The picture is smoothed so that nothing much smaller than a patch is left, and its tones are put into a few groups,
// those that differ least from what they replace (Lloyd's method in one dimension, from shares that need no chance).
// Pure functions.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace veneer::planner {

// Upper ends (0 to 255) of at most `groups` groups of tones, from dark to pale; the last is 255.
std::vector<int> tone_groups(const std::array<double, 256>& histogram, int groups);

// CV_32SC1, the group of each pixel's tone. `patch`: pixels.
cv::Mat tone_areas(const cv::Mat& bgr, double patch, int groups);

}  // namespace veneer::planner
