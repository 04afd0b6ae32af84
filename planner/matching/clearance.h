// Which places certainly cannot be taken, for patches of any shape, asked in well under a microsecond.
//
// A panel keeps how far each of its pixels is from wood that is gone; a patch is covered by a few discs within its
// outline. Where a disc's centre comes closer to gone wood than the disc reaches, grown by the kerf, FreeWood refuses
// the place too; all else is FreeWood's to decide. Discs do not care how the patch is turned, so shapes that share no
// pixel share the index all the same.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/free_wood.h"
#include "planner/matching/lattice.h"

namespace veneer::planner {

class Clearance {
 public:
  // Distances up to `reach` are known. kCancelled: within a band of rows after a stop was requested.
  static Result<Clearance> measure(const FreeWood& wood, Millimetres reach, const std::stop_token& stop);

  // The wood within these rings (grown_rings()) is gone.
  void take(const std::vector<Ring<PanelFrame>>& grown);

  // From a point to gone wood, in pixels of the stock raster; it may be kDoubt less. Points beyond the raster are gone.
  static constexpr double kDoubt = 0.75;
  static constexpr double kFarthest = 2000;  // nothing is said to be gone that is farther off
  double at(double column, double row) const {
    const int c = bordered(column, distance_.cols), r = bordered(row, distance_.rows);
    return distance_.ptr<std::uint16_t>(r)[c] * (1.0 / kUnits);
  }
  // At least at() of the same place and of all within a few pixels. Of a map so much smaller that it stays in the
  // processor's cache, where at() waits for memory each time.
  double at_most(double column, double row) const {
    const int c = bordered(column, distance_.cols) / kBlock, r = bordered(row, distance_.rows) / kBlock;
    return farthest_.ptr<std::uint16_t>(r)[c] * (1.0 / kUnits);
  }
  const Raster<PanelFrame>& raster() const { return raster_; }
  Millimetres kerf() const { return kerf_; }
  std::size_t bytes() const { return (distance_.total() + farthest_.total()) * distance_.elemSize(); }

 private:
  static constexpr double kUnits = 32;  // a pixel
  static constexpr int kBlock = 4;      // pixels of a side that at_most() answers for together
  // The pixel of a point, counted from the border's: what lies before it is the border. Asked so often that a call of
  // floor() would be most of it.
  static int bordered(double at, int size) { return std::clamp(static_cast<int>(at + 1), 0, size - 1); }
  // To be called when `part` of the distances has changed.
  void find_farthest(const cv::Rect& part);
  Clearance(const FreeWood& wood, Millimetres reach);
  cv::Mat rounded(const cv::Mat& distances) const;

  Raster<PanelFrame> raster_;  // shares the stock's pixels
  Millimetres kerf_;
  int reach_;
  cv::Mat distance_;  // CV_16UC1, with a border of one gone pixel
  cv::Mat farthest_;  // of each block of kBlock x kBlock of them
};

// A disc within an outline, in working pixels from the upper left corner of the patch's window.
struct CoverDisc {
  double x, y, radius;
};
// The largest first. `outline` in ArtworkFrame, `left` and `top` the window's.
std::vector<CoverDisc> cover_of(const Ring<ArtworkFrame>& outline, const PixelGrid& grid, int left, int top);

// A patch's discs on one lattice.
class Cover {
 public:
  Cover(const std::vector<CoverDisc>& discs, const Lattice& lattice, const Raster<PanelFrame>& picture,
        const Clearance& clearance);

  // Whether no place within `around` working pixels of lattice place (x, y) can be taken, for certain.
  bool rules_out(double x, double y, double around) const {
    return any_disc(x, y, around, [&](double column, double row) { return clearance_.at_most(column, row); }) ||
           any_disc(x, y, around, [&](double column, double row) { return clearance_.at(column, row); });
  }

 private:
  // Whether a disc reaches farther than `room` says for its centre.
  template <class Room>
  bool any_disc(double x, double y, double around, const Room& room) const {
    const double column = column_ + column_x_ * x + column_y_ * y, row = row_ + row_x_ * x + row_y_ * y;
    const double less = around * scale_;
    return std::any_of(discs_.begin(), discs_.end(),
                       [&](const CoverDisc& disc) { return room(column + disc.x, row + disc.y) + less < disc.radius; });
  }

  const Clearance& clearance_;
  std::vector<CoverDisc> discs_;  // in pixels of the stock raster, turned to it; radii grown
  double scale_;                  // such pixels a working pixel
  double column_, column_x_, column_y_, row_, row_x_, row_y_;
};

}  // namespace veneer::planner
