// The closed regions of a drawing as a picture of areas: what --segmentation takes beside pictures.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"

namespace veneer::cli {

// CV_8UC3, each closed line's inside in a colour of its own, what was drawn later over what was drawn before; what
// lies in none of them is black. The picture reaches from edge to edge of what is drawn. kInvalidArgument: it is no
// SVG that read_svg() takes, has no closed region, or is flat.
Result<cv::Mat> areas_of_svg(const std::string& text);

}  // namespace veneer::cli
