// What a sheet on its board shows along straight lines: means over slabs, some millimetres of a line together, and the
// sides of strips, which are steps between them. Internal to the finder of strips. Thread-safe.
//
// Frames: columns and rows of the work map, or with the two exchanged; a line is x = at + tilt * (y - the stretch's
// middle), px.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board_model.h"

namespace veneer::calib {

inline constexpr double kSteepest = 0.012;  // tilt of a side against the sheet's
inline constexpr double kClear = 3;         // spreads: a step that is worth calling one
inline constexpr double kShare = 0.25;      // of the slabs, how many need not show a step that counts as seen

// Lightness and two opponent colours against the board, logarithms.
using BoardValue = std::array<double, 3>;

// The planes' sums over rectangles, in the map's own axes or with x and y exchanged. Tags and holes count as board:
// their sides are straight too, and clearer than many a strip's.
class SlabView {
 public:
  SlabView(const BoardView& view, const cv::Mat& fiducials, bool exchanged);
  int columns() const { return sums_[0].cols - 1; }
  double px() const { return px_; }
  const BoardValue& spread() const { return spread_; }
  // How far the board's two opponent colours may be off in its full light.
  const std::array<double, 2>& hue() const { return hue_; }
  const cv::Mat& sums(std::size_t plane) const { return sums_[plane]; }

 private:
  double px_;
  BoardValue spread_;
  std::array<double, 2> hue_{};
  std::array<cv::Mat, 3> sums_;
};

// A stretch of the view's rows, cut into slabs that are looked at as one row each.
class Stretch {
 public:
  // Of the rows `from` to `to`. `view` outlives it.
  Stretch(const SlabView& view, int from, int to);
  const SlabView& view() const { return view_; }
  int slabs() const { return count_; }
  double length() const { return to_ - from_; }
  double middle() const { return 0.5 * (from_ + to_); }
  double from_middle(int slab) const { return 0.5 * (edge(slab) + edge(slab + 1)) - middle(); }
  // Where the line x = at + tilt * (y - middle) crosses the slab.
  int crossing(int slab, double at, double tilt) const {
    return static_cast<int>(std::lround(at + tilt * from_middle(slab)));
  }
  BoardValue mean(int slab, int left, int right) const {
    left = std::clamp(left, 0, view_.columns() - 1), right = std::clamp(right, left + 1, view_.columns());
    BoardValue out{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double* sums = slabs_[k].data() + static_cast<std::size_t>(slab) * width_;
      out[k] = (sums[right] - sums[left]) / (right - left);
    }
    return out;
  }

 private:
  int edge(int slab) const;

  const SlabView& view_;
  int from_, to_, count_;
  std::size_t width_;
  std::array<std::vector<double>, 3> slabs_;  // sums along x of each slab's mean row
};

// The step across a line that all but `share` of the slabs reach, in spreads of the board.
double step_along(const Stretch& stretch, double at, double tilt, double share);

struct SeenSide {
  double at = 0, tilt = 0;
  double step = 0;  // that all but kShare of the slabs reach, in spreads; 0: no side was seen
};
// Looks for a side near `at`, so many pixels outwards and inwards. Of clear steps the outermost one counts: the wood's
// own lines lie within.
SeenSide find_side(double at, double outwards, double inwards, const Stretch& stretch, bool outwards_is_less);

}  // namespace veneer::calib
