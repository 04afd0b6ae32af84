// From any raster of labels to a partition whose faces can all be cut.
//
// Labels are cleaned (label_regions.h) and their borders fitted (label_partition.h). Where a face that comes of it is
// not fabricable (fabrication.h) or has no room for its mark (cutting/marks.h), its borders are straightened less;
// where that does not help, it becomes part of the neighbour with which it shares the longest border. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/partition.h"

namespace veneer::planner {

struct FabricableOptions {
  FabricationLimits limits;
  Millimetres row{10};  // faces are in reading order: in rows of this height, from left to right
  Smoothness smoothness = Smoothness::kG0;
  int threads = 1;
  // Of the artwork: every face is to have room for the mark that is this and its number. Empty: that is not asked.
  std::string letter{};
  bool short_marks = false;  // or for its short mark, if the artwork is alone in its plan
};

// What became of the labels' regions, parts of one label that hang together.
struct RegionFates {
  struct Merged {
    Point<ArtworkFrame> at;  // within it
    SquareMillimetres area{};
  };
  std::size_t regions = 0;
  std::vector<Merged> merged;  // those of which no face has more than of any other, the largest first
};

// `labels`: CV_32SC1 over the artwork, any. All faces are as `options` wants them, unless a single one is left.
// kCancelled: a stop was requested. `fates`, if given, is filled; of a label that is parted or loses a tip no word is
// said.
Result<Partition> fabricable_partition(cv::Mat labels, Millimetres width, Millimetres height,
                                       const FabricableOptions& options, const std::stop_token& stop = {},
                                       RegionFates* fates = nullptr);

}  // namespace veneer::planner
