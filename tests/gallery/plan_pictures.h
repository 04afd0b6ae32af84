// Pictures of a plan that was made. All are CV_8UC3, BGR.
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "tests/gallery/plan_runs.h"

namespace veneer::gallery {

struct PlanView {
  const PlanRun& run;
  std::size_t artwork = 0;
  cv::Mat target;              // its picture, any size
  std::filesystem::path wood;  // the picture of the plan's first panel
};

// The assembled picture, as the planner drew it.
Result<cv::Mat> preview_picture(const PlanView& view);
// The same, twice as large, with the outlines of its pieces.
Result<cv::Mat> with_cut_lines(const PlanView& view);
// Each piece in the mean colour of its wood: what is left without grain.
Result<cv::Mat> in_mean_colours(const PlanView& view);
// Each piece in the mean colour of the target there, between joints: a mosaic in flat colours.
Result<cv::Mat> in_flat_colours(const PlanView& view);
// The first panel without the wood that the plan takes.
Result<cv::Mat> taken_wood(const PlanView& view);

}  // namespace veneer::gallery
