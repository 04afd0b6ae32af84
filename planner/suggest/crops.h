// Which part of a picture to rebuild: the whole of it, and closer ones around what is salient. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::planner {

// "X,Y,WIDTH,HEIGHT", in whole pixels. kInvalidArgument: the text is no such thing.
Result<cv::Rect> crop_of(const std::string& text);
// The same, and kInvalidArgument when it does not lie within the picture, which is called `name`.
Result<cv::Rect> crop_of(const std::string& text, const cv::Size& picture, const std::string& name);
std::string crop_text(const cv::Rect& crop);

// Leaves of the artwork's pictures what belongs to this part of Artwork::picture, which it must lie within.
void crop_pictures(Artwork& artwork, const cv::Rect& crop);

// In pixels of the picture, of its shape, the widest first. Closer ones lie where `saliency` (a CV_32FC1 map stretched
// over the picture) has most within them, more so near the picture's middle, and within each other.
std::vector<cv::Rect> crops_of(const cv::Size& picture, const cv::Mat& saliency);

}  // namespace veneer::planner
