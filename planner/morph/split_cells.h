// Cells of a grid cut in two along a diagonal where an edge of the picture runs (paper, section 3.4: triangles).
//
// A line of the grid can follow an edge that leans by up to 40 degrees; one at 45 degrees crosses a whole row of cells.
// A cell is split where its two halves, each of one tone, show the picture far better than the whole does in one tone,
// where edges lie along the cut, and where both halves are fabricable. Pure function, the same for any number of
// threads.
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/layout/fabrication.h"
#include "planner/layout/partition.h"
#include "planner/matching/lattice.h"
#include "planner/morph/fitted_lines.h"

namespace veneer::planner {

struct SplitLimits {
  FabricationLimits limits;
  Millimetres size{5};  // each half holds a disc of this diameter
  int threads = 1;
};

struct SplitCells {
  Partition partition;              // the upper half of a cell takes its place among the faces, the lower one follows
  std::size_t count = 0;            // cells that were split
  std::vector<PartitionEdge> cuts;  // where, a straight line each
  HalfTones tones;                  // of the cells as they were, the halves' mean tones where they were split
};

// `cells`: its faces have four sides. `tones`: CV_32FC1, 0 to 1, and `edges`: CV_8UC1, not 0 on lines a pixel wide,
// both over `grid`.
SplitCells split_cells(const Partition& cells, const cv::Mat& tones, const cv::Mat& edges, const PixelGrid& grid,
                       const SplitLimits& limits);

}  // namespace veneer::planner
