// Which working pixels belong to a patch, and what they cost on a place.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/matching/lattice.h"

namespace veneer::planner {

// A patch's pixels: those whose centre lies inside its outline. Pixels on a shared border belong to one of the two.
struct PatchPixels {
  int left = 0, top = 0, width = 0, height = 0;  // the window: pixels with centres in the outline's bounding box
  struct Span {
    int row = 0;             // of the artwork
    int begin = 0, end = 0;  // columns of the artwork
    int length() const { return end - begin; }
    friend bool operator==(const Span&, const Span&) = default;
  };
  std::vector<Span> spans;  // from above, then from the left; apart, none empty
  std::int64_t count = 0;

  // All pixels of the window count.
  bool filled() const { return count == static_cast<std::int64_t>(width) * height; }
};

// For any simple outline, of either direction; curves come as polygons. `columns` and `rows` bound the artwork's
// working picture.
PatchPixels patch_pixels(const Ring<ArtworkFrame>& outline, const PixelGrid& grid, int columns, int rows);

// Equation 4 over a patch's pixels: squared distance of weighted features (CV_32FC(n), features.h), the panel's sampled
// bilinearly where `panel_from_artwork` puts each pixel's centre. Stops once above `limit`, with a value above it.
double placement_cost(const cv::Mat& target_features, const PixelGrid& grid, const PatchPixels& pixels,
                      const Raster<PanelFrame>& panel_features,
                      const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork, double limit = 1e300);

}  // namespace veneer::planner
