// Which index windows that are not filled are matched with, whatever their sizes.
//
// A map of block means (coarse_map.h) knows no windows: a patch lays as many blocks over its own as that takes. Only
// the number of blocks matters, since few say little and many take long. So the windows of a layout share one map, or a
// few where their areas differ by more than some times: one a scale.
#pragma once

#include <vector>

#include "planner/matching/coarse_map.h"
#include "planner/matching/patch_pixels.h"

namespace veneer::planner {

class OddWindows {
 public:
  // Of these classes those that are not filled; no patch of them may have a larger window than they say.
  explicit OddWindows(const std::vector<WindowClass>& classes);

  // The finest first; none where all classes are filled.
  std::size_t scales() const { return sides_.size(); }
  std::size_t scale_of(const PatchPixels& pixels) const;
  // The cells of a scale, as many as the window that takes most of them.
  CellGrid grid(std::size_t scale) const;
  // What all windows have in common.
  const WindowClass& windows() const { return windows_; }

 private:
  WindowClass windows_;
  double least_ = 0, step_ = 1;  // of areas, in pixels; how many times as large the next scale's are
  std::vector<double> sides_;    // of a cell
};

// The cells of a scale that a window takes: rows and columns of whole blocks, the last of which may reach beyond it.
CellGrid cells_over(const CellGrid& scale, int width, int height);

}  // namespace veneer::planner
