// The pieces that are truly cut out of a sheet: every part of the wood that through-cuts have parted from the rest.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "drivers/sim/proof/burn_raster.h"

namespace veneer::proof {

struct CutOut {
  std::vector<Vec2> contour;  // true edge in sheet mm, counter-clockwise, a point each 0.02 mm
  Vec2 centroid{};
  double area_mm2 = 0;
  Window window;  // at 0.02 mm per pixel
  cv::Mat mask;   // CV_8UC1 over `window`, 255 = wood of this piece
};

// All cut-outs of at least 4 mm2, in reading order of the sheet. The sheet's own holes count as cuts too.
// `threads` workers share the fine work.
std::vector<CutOut> find_cut_outs(const sim::Sheet& sheet, const BurnIndex& burns, int threads);

// What a viewer of the sheet's back sees of the piece at the window's resolution: grey, 8 bit, engraving darkened,
// white beside the piece. It lies on something dark, which shows where the beam burnt through it. x runs to the
// viewer's right, so it is flipped against the window.
cv::Mat back_picture(const sim::Sheet& sheet, const BurnIndex& burns, const CutOut& piece);

}  // namespace veneer::proof
