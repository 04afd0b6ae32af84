// Which working pixels belong to a patch, and what they cost on a place.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/matching/lattice.h"

namespace veneer::planner {

// A patch's pixels: those whose centre lies inside its outline. Pixels on a shared border belong to one of the two.
struct PatchPixels {
  int left = 0, top = 0, width = 0, height = 0;  // the window around them, in working pixels of the artwork
  struct Span {
    int begin = 0, end = 0;  // columns of the artwork
  };
  std::vector<Span> rows;  // one a window row; may be empty
  std::int64_t count = 0;
};

// For a convex outline; `columns` and `rows` bound the artwork's working picture.
PatchPixels patch_pixels(const Ring<ArtworkFrame>& outline, const PixelGrid& grid, int columns, int rows);

// Equation 4 over a patch's pixels: squared distance of weighted features (CV_32FC(n), features.h), the panel's sampled
// bilinearly where `panel_from_artwork` puts each pixel's centre. Stops once above `limit`, with a value above it.
double placement_cost(const cv::Mat& target_features, const PixelGrid& grid, const PatchPixels& pixels,
                      const Raster<PanelFrame>& panel_features,
                      const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork, double limit = 1e300);

}  // namespace veneer::planner
