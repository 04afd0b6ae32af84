// A-priori grid morphing (paper, section 3.4, equations 5 to 7, figure 7): a grid whose lines follow the picture's
// edges before wood is chosen, and whose cells can all be cut.
#pragma once

#include <opencv2/core/mat.hpp>
#include <stop_token>

#include "base/result.h"
#include "planner/boundaries/cut_lines.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/layout_guides.h"
#include "planner/layout/partition.h"
#include "planner/matching/lattice.h"
#include "planner/morph/edge_image.h"
#include "planner/morph/grid_preview.h"

namespace veneer::planner {

struct MorphOptions {
  Millimetres patch{14};  // wished side of a patch, as grid_size() takes it
  FabricationLimits limits;
  Millimetres size{5};  // patches hold a disc of this diameter, where squares do
  Smoothness smoothness = Smoothness::kG0;
  int threads = 1;
  LayoutGuides guides{};
  bool triangles = false;  // cells are split where an edge runs along a diagonal (split_cells.h)
  double fineness = 1;     // PlanOptions::layout_fineness
  EdgeFinder edges = all_edges;
};

struct MorphFigures {
  Millimetres mean_move{0}, most_move{0};    // of the grid's vertices from where the straight grid has them
  double edges_before = 0, edges_after = 0;  // share of the edges' pixels within a pixel of a border
  std::size_t relaxed = 0;                   // cells that were drawn back towards the straight grid, to be fabricable
  std::size_t split = 0;                     // cells that are two triangles
  friend bool operator==(const MorphFigures&, const MorphFigures&) = default;
};

struct MorphedGrid {
  Partition partition;  // faces in reading order of the grid: row by row; both halves of a cell, the upper one first
  CutLines lines;       // the same in pixels of `grid`, faces alike; halves are not in it
  MorphFigures figures;
};

// `bgr`: the picture, CV_8UC3 of any size. `tones`: CV_8UC1 over `grid`, what wood is looked for. Cells that are not
// fabricable are relaxed until all are. The grid is straight to the last bit where the picture has no edges, and where
// its squares are not fabricable either. Pinned vertices of the partition lie within a micrometre of where they are to
// be. A pure function of its arguments, whatever the number of threads. kInvalidArgument: a vertex that is pinned is
// none of the grid's, may not be there, or leaves a cell no room to be fabricable. kCancelled: a stop was requested.
Result<MorphedGrid> morphed_grid(const cv::Mat& bgr, const cv::Mat& tones, Millimetres width, const PixelGrid& grid,
                                 const MorphOptions& options, const std::stop_token& stop = {});

// About where the lines of morphed_grid() will be, in a small part of its time: springs alone, at few pixels a cell;
// lines are not fitted to tones, and no cell is looked at. Pinned vertices lie where they are to be. Errors as
// morphed_grid(), but for cells without room.
Result<GridPreview> coarse_grid(const cv::Mat& bgr, Millimetres width, Millimetres height, const MorphOptions& options,
                                const std::stop_token& stop = {});

}  // namespace veneer::planner
