// The picture as it will be when it lies on the table: with the joints between its pieces, the wood that the beam
// browned beside them, and as little of both as is seen from where one stands. A preview without them shows a picture
// that nobody will ever have.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::planner {

struct AsBuilt {
  Millimetres clearance{0.05};   // width of a joint, cut off on purpose (ToolpathOptions::fit_clearance)
  Millimetres char_width{0.10};  // how far from a cut the show face is browned
  double char_depth = 0.34;      // how far towards char it is at the very edge; 0: clean cuts, 1: black ones
  // BGR, what joints are filled with. None: they stay open, and the dark below is seen.
  std::optional<cv::Vec3b> putty{};
  // From where one looks: what is smaller than a minute of arc blurs. 0: from as near as one likes.
  Millimetres distance{0};
};

// `preview` as assemble_preview() gives it, CV_8UC3 of any resolution, covering the artwork. Every border counts as a
// joint, the picture's own edge too, half of it. A joint narrower than a pixel darkens it by its share of it.
// kInvalidArgument: no such artwork, or a size that is none.
Result<cv::Mat> as_built(const Plan& plan, std::size_t artwork, const cv::Mat& preview, const AsBuilt& look);

// "d8c8a0", red, green, blue, as pages write colours. kInvalidArgument: another text.
Result<cv::Vec3b> colour_of(std::string_view text);

}  // namespace veneer::planner
