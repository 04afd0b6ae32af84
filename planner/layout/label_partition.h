// From a raster of labels to a planar partition: the borders between regions, traced along pixels, straightened, and
// fitted by cubic Bezier curves.
//
// The raster covers the artwork. Where three regions or more meet, and at the artwork's corners, is a vertex; between
// two vertices two regions share one edge. Pure functions; thread-safe.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/layout/bezier_fit.h"
#include "planner/layout/partition.h"

namespace veneer::planner {

// How far an edge may leave the middles of the pixels' sides that it stands for.
enum class Straightening : std::uint8_t {
  kFree,   // smoothed, then as few curves as lie within kLabelTolerance
  kClose,  // the same, a third as much
  kNone    // straight from one side's middle to the next: never crosses another edge
};
inline constexpr double kLabelTolerance = 0.7;  // pixels

// `labels`: CV_32SC1 as clean_regions() leaves it; face n is region n. `straightening`: one a region, of two neighbours
// the stricter counts.
Partition partition_of_labels(const cv::Mat& labels, Millimetres width, Millimetres height, Smoothness smoothness,
                              const std::vector<Straightening>& straightening);

}  // namespace veneer::planner
