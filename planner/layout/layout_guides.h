// What a person says about how an artwork is to be cut up. Of a morphed grid: which edges of the picture count, and
// where vertices belong (paper, section 3.4: edge images that can be edited by hand). Of a mosaic: where its cells are
// to be small, and which curves they lie along (Hausner 2001, sections 4 and 5.2). Other layouts heed nothing of it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/drawings/flow_lines.h"
#include "planner/layout/pinned_vertices.h"

namespace veneer::planner {

struct LayoutGuides {
  // CV_8UC1 of any size, stretched over the artwork: edges count where it is pale (128 and more). `large` is for those
  // that rolling guidance leaves, of large structures, `fine` for those that the bilateral filter leaves. Empty: all of
  // them count.
  cv::Mat large{}, fine{};
  std::vector<PinnedVertex> vertices{};
  // CV_8UC1 of the artwork's shape, stretched over it: where it is white cells are the smallest, where it is black the
  // largest. Empty: the picture's saliency says so.
  cv::Mat cell_sizes{};
  std::vector<FlowLine> flow_lines{};

  bool guide_a_grid() const { return !large.empty() || !fine.empty() || !vertices.empty(); }
  bool guide_a_mosaic() const { return !cell_sizes.empty() || !flow_lines.empty(); }
  bool empty() const { return !guide_a_grid() && !guide_a_mosaic(); }
};

}  // namespace veneer::planner
