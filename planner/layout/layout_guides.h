// What a person says about how an artwork is to be cut up. Of a morphed grid: which edges of the picture count, and
// where vertices belong (paper, section 3.4: edge images that can be edited by hand). Of a mosaic: where its cells are
// to be small, and which curves they lie along (Hausner 2001, sections 4 and 5.2). Other layouts heed nothing of it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"
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

// kInvalidArgument: `sizes`, of the cells of the artwork called `name`, are not CV_8UC1, or of another shape than its
// picture. An empty mask is good; one of a single tone means cells of one size.
Status check_cell_sizes(const cv::Mat& sizes, const cv::Size& picture, const std::string& name);
// The same of what somebody painted, who means something else by one tone: so before anything is cropped, as of a crop
// a mask may well have one tone.
Status check_painted_sizes(const cv::Mat& sizes, const cv::Size& picture, const std::string& name);

}  // namespace veneer::planner
