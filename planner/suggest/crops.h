// Which part of a picture to rebuild: the whole of it, and closer ones around what is salient. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

// Leaves of the artwork's pictures what belongs to this part of Artwork::picture, which it must lie within.
void crop_pictures(Artwork& artwork, const cv::Rect& crop);

// In pixels of the picture, of its shape, the widest first. Closer ones lie where `saliency` (a CV_32FC1 map stretched
// over the picture) has most within them, more so near the picture's middle, and within each other.
std::vector<cv::Rect> crops_of(const cv::Size& picture, const cv::Mat& saliency);

}  // namespace veneer::planner
