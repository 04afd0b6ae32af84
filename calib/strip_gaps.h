// Gaps between strips of veneer, through which the board is seen. Internal to the finder of strips. Thread-safe.
#pragma once

#include <vector>

#include "calib/slabs.h"

namespace veneer::calib {

inline constexpr double kNarrowestStrip = 6;  // mm

// Of the work map, in the view's axes, px.
struct SlabRegion {
  int left = 0, right = 0, top = 0, bottom = 0;
};

// Columns of a region.
struct StripGap {
  double from = 0, to = 0;
  double clear = 0;  // the lesser step of its two sides, in spreads of the board
  int lit = 0;       // columns of it that show nothing but the board in its full light
};

// Gaps that run through the whole region: bands of board between two steps that all but `share` of the slabs show. From
// left to right.
std::vector<StripGap> find_gaps(const SlabView& view, const SlabRegion& region, double share);
// Bands of nothing but board, fully lit somewhere, through a region whose strips end raggedly, so that no line bounds
// them. From left to right.
std::vector<StripGap> find_ragged_gaps(const SlabView& view, const SlabRegion& region);

// Of a region that was taken for one strip: the widest band of its columns, along any tilt of a side, that shows
// nothing but the lit board from end to end, px; 0 if there is none. It is a gap that was not taken for one, with wood
// beside it that is clearly no board, and no wider than gaps are (6 mm; wood in the board's colour may be as wide as a
// strip); or, however wide, board that a side was set too far out for.
double widest_board_band(const SlabView& view, const SlabRegion& strip);

}  // namespace veneer::calib
