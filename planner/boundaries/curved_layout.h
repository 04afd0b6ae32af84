// From lines over pixels to a partition with curved edges.
#pragma once

#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/partition.h"
#include "planner/matching/lattice.h"

namespace veneer::planner {

inline constexpr Millimetres kFitTolerance{0.05};  // between a fitted curve and the cut that it stands for
inline constexpr Millimetres kWantedSegment{3};    // curves are no shorter than this on the mean

// Faces in the order of `lines.faces`. Whole micrometres but on the artwork's border; every fitted edge lies within
// kFitTolerance of its line. `height`: of the artwork, like `grid`. Pure; runs on the calling thread.
Partition curved_layout(const CutLines& lines, Millimetres width, const PixelGrid& grid, Smoothness smoothness);

// Of the edges between two faces.
struct CurveLength {
  std::size_t segments = 0;
  Millimetres length{0};
  // Whether curves are as long as wanted on the mean.
  bool long_enough() const { return static_cast<double>(segments) * kWantedSegment <= length; }
  CurveLength& operator+=(const CurveLength& other) {
    segments += other.segments, length += other.length;
    return *this;
  }
};
CurveLength curve_length(const Partition& partition);

}  // namespace veneer::planner
