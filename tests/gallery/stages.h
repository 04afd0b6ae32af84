// What happens between a picture and its plan, drawn with the planner's own functions. All are CV_8UC3, BGR.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/units.h"
#include "planner/plan.h"
#include "tests/gallery/sources.h"

namespace veneer::gallery {

struct StageView {
  cv::Mat target;  // CV_8UC3
  planner::PlanOptions options;
  Millimetres size;  // of the shorter side
  Sources::Wood wood;
  const PlanOrder& order;
  Sources& sources;
};

Result<cv::Mat> target_picture(const StageView& view);
Result<cv::Mat> wood_picture(const StageView& view);
// The areas of one tone that are the patches of a segmentation.
Result<cv::Mat> areas_picture(const StageView& view);

// Tones (parquetry, equation 2): the wood's intensity, and the target's mapped to it by w_hist.
Result<cv::Mat> grey_wood(const StageView& view);
Result<cv::Mat> matched_tones(const StageView& view);

// Which patches of the grid choose first: red, then yellow.
Result<cv::Mat> urgency_picture(const StageView& view);

// Morphing (parquetry, section 3.4): the picture without what is small, without noise, and the edges that lines follow.
Result<cv::Mat> guidance_picture(const StageView& view);
Result<cv::Mat> bilateral_picture(const StageView& view);
Result<cv::Mat> edge_picture(const StageView& view);

// The mosaic: its edges over its direction field, the sizes of its tiles (small ones dark); the cells of random sites,
// of sites after twenty iterations, and of sites at rest away from edges.
Result<cv::Mat> field_picture(const StageView& view);
Result<cv::Mat> size_picture(const StageView& view);
Result<cv::Mat> scattered_cells(const StageView& view);
Result<cv::Mat> resting_cells(const StageView& view);
Result<cv::Mat> avoiding_cells(const StageView& view);

// Tiles with joints, in the colours of the picture: squares, squares of one size, long ones, ovals that overlap.
Result<cv::Mat> square_tiles(const StageView& view);
Result<cv::Mat> equal_tiles(const StageView& view);
Result<cv::Mat> long_tiles(const StageView& view);
Result<cv::Mat> oval_tiles(const StageView& view);
// The grid's patches in flat colours: pixels.
Result<cv::Mat> pixels_picture(const StageView& view);
// Voronoi cells of random sites, in flat colours, as Haeberli drew them.
Result<cv::Mat> random_cells(const StageView& view);

}  // namespace veneer::gallery
