// What of a file becomes the pieces of a picture: the areas of a picture, or the closed regions of a drawing. Pure;
// thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::planner {

// As Artwork::segmentation wants it (CV_8UC3), of an SVG drawing or of any picture that decode_labels() takes: which of
// them it is, its bytes say. `name` stands in error messages. kInvalidArgument: it is neither, or areas_of_svg()
// refuses it.
Result<cv::Mat> areas_of_file(std::string_view bytes, const std::string& name);

// ".svg", ".png" or ".jpg", by which a program knows such a file; "" of other bytes.
std::string_view ending_of(std::string_view bytes);

// CV_8UC3, the inside of each line in a colour of its own, what was drawn later over what was drawn before; what lies
// in none of them has one too. An open line that is filled is closed, as a viewer does. A straight one, filled or not,
// has no inside: where it has a colour it parts the areas that it crosses, from border to border; one
// that is not seen, or ends within an area, is passed over. The picture reaches from edge to edge of the regions.
// kInvalidArgument: it is no SVG that read_svg() takes, has no region or another open line, or is flat or without
// measure.
Result<cv::Mat> areas_of_svg(const std::string& text);

}  // namespace veneer::planner
