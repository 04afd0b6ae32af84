// Where the border of a tag's black square runs, to a fraction of a pixel, though something lies on part of it: a
// stain, a scorched corner, dust. Internal to the tag detector. Thread-safe.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>

namespace veneer::calib {

// Corners in the detector's order, px, centres at +0.5.
using TagCorners = std::array<Eigen::Vector2d, 4>;

// The corners as the four straight sides put them. Each side is found from the places along it where black turns into
// white as it does at most others; what lies on the rest, corners too, counts for nothing. `found` itself where a side
// is unclear, or where sides that most places agree on put a corner farther off than half a cell.
TagCorners refine_corners(const cv::Mat& grey, const TagCorners& found);

}  // namespace veneer::calib
