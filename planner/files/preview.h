// The assembled picture, as it will lie on the table.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "planner/plan.h"

namespace veneer::planner {

// CV_8UC3, BGR; covers the artwork, its origin at the artwork's lower left corner. Colours are the panels' pictures;
// unfilled patches are magenta (255, 0, 255). Panels are found in `stock` by id.
// kNotFound: a piece's panel is not in `stock`. kInvalidArgument: no such artwork.
Result<Raster<ArtworkFrame>> assemble_preview(const Plan& plan, std::size_t artwork, std::span<const StockPanel> stock,
                                              ScanResolution resolution);

// The finest of the panels that the artwork's wood comes from: at it a preview shows all that their pictures have. The
// plan's own where no piece has wood. kInvalidArgument: no such artwork.
Result<ScanResolution> full_resolution(const Plan& plan, std::size_t artwork);

// Draws where the laser cuts into a preview of any resolution: every piece's outline, about as wide as the kerf and at
// least two pixels. kInvalidArgument: no such artwork.
Status draw_cut_lines(const Plan& plan, std::size_t artwork, Raster<ArtworkFrame>& preview);

// The preview with each filled piece in the mean of its own colours: what is left of the picture without the wood's
// grain (paper, Figure 8, bottom row). CV_8UC3. kInvalidArgument: no such artwork.
Result<cv::Mat> in_mean_colours(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview);

// What the assembled preview itself costs against what its artwork looks for: as cost_per_pixel(), but with all
// features of the preview's own 8-bit colours, so that edges across seams count. Over the pixels of filled pieces.
struct PreviewCost {
  double total = 0;
  std::int64_t pixels = 0;
  PreviewCost& operator+=(const PreviewCost& other) {
    total += other.total, pixels += other.pixels;
    return *this;
  }
  std::optional<double> per_pixel() const {
    return pixels == 0 ? std::nullopt : std::optional(total / static_cast<double>(pixels));
  }
};
// `preview` is what assemble_preview() gives at the plan's working resolution, `options` what it was planned with.
// kInvalidArgument: the plan does not come from make_plan, or the preview has another size.
Result<PreviewCost> preview_cost(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview,
                                 const PlanOptions& options);

}  // namespace veneer::planner
