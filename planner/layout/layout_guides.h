// What a person says about how an artwork is to be cut up: which edges of the picture count, and where vertices of its
// grid belong (paper, section 3.4: edge images that can be edited by hand). Only morphed grids heed it so far.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/layout/pinned_vertices.h"

namespace veneer::planner {

struct LayoutGuides {
  // CV_8UC1 of any size, stretched over the artwork: edges count where it is pale (128 and more). `large` is for those
  // that rolling guidance leaves, of large structures, `fine` for those that the bilateral filter leaves. Empty: all of
  // them count.
  cv::Mat large{}, fine{};
  std::vector<PinnedVertex> vertices{};

  bool empty() const { return large.empty() && fine.empty() && vertices.empty(); }
};

}  // namespace veneer::planner
