// Edges that end somewhere, and where they would go on. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::planner {

// The edges (CV_8UC1, 255 on lines one pixel wide) with each loose end led on straight for `length` pixels,
// but no farther than to the next edge.
cv::Mat with_longer_ends(const cv::Mat& edges, double length);

}  // namespace veneer::planner
