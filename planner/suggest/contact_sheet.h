// Suggestions side by side, as a person compares them. Pure.
#pragma once

#include <chrono>
#include <opencv2/core/mat.hpp>
#include <string>

#include "planner/suggest/suggestions.h"

namespace veneer::planner {

// CV_8UC3: a row for each crop, the part of the picture that it shows first, then its suggestions, numbered from 1; the
// best in a frame. Below each what it takes.
cv::Mat contact_sheet(const Advice& advice, const cv::Mat& picture);

// "52 min", "1 h 10 min".
std::string duration_text(std::chrono::duration<double> duration);
// "mosaic", as `--layout` takes it.
std::string layout_text(LayoutKind layout);

}  // namespace veneer::planner
