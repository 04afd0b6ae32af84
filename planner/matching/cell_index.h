// What is known of the places of one lattice before looking at pixels: intervals of block features over small cells of
// places, and which places are still free.
//
// A window is cut into blocks. For each block and channel the n pixels split into their mean and what deviates from it;
// by Pythagoras and the triangle inequality  |x - y|^2 >= n (mean_x - mean_y)^2 + n (deviation_x - deviation_y)^2.  All
// blocks have the same size, so one map of block features serves every block of the window, shifted by whole cells;
// what blocks leave over at the right and below counts as one more part. A cell of cell_x x cell_y places keeps the
// interval that each feature takes in it: the bound holds for all its places at once.
#pragma once

#include <cmath>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/banded_polygon.h"
#include "planner/matching/rotated_panel.h"

namespace veneer::planner {

// How a window of a given size is cut into blocks along one axis; pixels that are left over belong to the rest.
struct BlockAxis {
  int cell = 1;  // places a cell
  int blocks = 1;
  int block = 1;  // pixels a block: a multiple of cell, so that blocks start on cells
  int covered() const { return blocks * block; }
  friend bool operator==(const BlockAxis&, const BlockAxis&) = default;
};
BlockAxis choose_blocks(int window);

// Slack of tests that may only clear places which the exact rule refuses too, in pixels.
inline constexpr double kClearSlack = 1e-6;
// The middle of an outline's bounding box lies in its convex hull, so on the panel; the window's is so many pixels off.
inline constexpr double kMiddleDoubt = 2;

// Windows that share an index: patches of one size.
struct WindowClass {
  BlockAxis x, y;
  int width = 0, height = 0;    // pixels that every window of the class has
  int widest = 0, tallest = 0;  // the most that one has
  // Pixels in the smallest window and in the largest.
  std::int64_t least = 0, most = 0;
  double block_pixels() const { return static_cast<double>(x.block) * y.block; }
  double rest_pixels() const {
    return static_cast<double>(width) * height - static_cast<double>(x.covered()) * y.covered();
  }
  // Features of the rest are scaled so that its pixels count as many as a block's.
  double rest_scale() const { return std::sqrt(rest_pixels() / block_pixels()); }
  bool filled = true;  // all pixels of all windows belong to their patch
  // If so: the rectangle, in pixels from the window's corner, that every outline of the class covers. Other shapes may
  // have nothing in common; what they cover is looked at patch by patch (clearance.h).
  double left = 0, top = 0, right = 0, bottom = 0;
  // If not: what all outlines have on the panel, from their window's corner, to within middle_doubt() pixels.
  double middle_x() const { return (width + widest) / 4.0; }
  double middle_y() const { return (height + tallest) / 4.0; }
  double middle_doubt() const { return kMiddleDoubt + std::hypot(widest - width, tallest - height) / 4; }
  friend bool operator==(const WindowClass&, const WindowClass&) = default;
};

// The pixels of a stock raster that are not free, thinned: all that have a free neighbour, and of the others one in
// every `stride` x `stride`, so that a rectangle with sides of at least `stride` on blocked wood always covers one.
struct BlockedPixels {
  std::vector<Point<PanelFrame>> centres;
  Millimetres side;  // of one pixel
};
// kCancelled: within a row after a stop was requested.
Result<BlockedPixels> blocked_pixels(const Raster<PanelFrame>& free, Millimetres shortest_side,
                                     const std::stop_token& stop);

// An outline that lies on a panel, in the coordinates of a lattice of it.
BandedPolygon on_lattice(const std::vector<Ring<PanelFrame>>& rings, const Raster<PanelFrame>& picture,
                         const Lattice& lattice);

struct RowExtremes;  // window_sums.h

class CellIndex {
 public:
  // Fine units per entry of the rotated panel, for means and deviations.
  static constexpr int kFineUnits = 4;
  enum Feature { kMean, kDeviation, kFeatures };
  // A block (of the window whose corner is the cell's place), or what no block covers.
  enum Part { kBlock, kRest };

  // `picture` is the panel at the working resolution; `border` is what outlines keep from blocked pixels. kCancelled:
  // within a row of cells after a stop was requested.
  static Result<CellIndex> make(const RotatedPanel& panel, const WindowClass& windows,
                                const Raster<PanelFrame>& picture, const BlockedPixels& blocked, Millimetres border,
                                const std::stop_token& stop);

  const WindowClass& windows() const { return windows_; }
  int cell_rows() const { return static_cast<int>(alive_begin_.size()); }
  // Cells of a row that may hold free places.
  int begin(int row) const { return alive_begin_[static_cast<std::size_t>(row)]; }
  int end(int row) const { return alive_end_[static_cast<std::size_t>(row)]; }
  // One bit a place, bit number = y * cell_x + x; set: possibly free (FreeWood decides), clear: certainly not.
  const std::uint32_t* places(int row) const { return places_.data() + base_[static_cast<std::size_t>(row)]; }
  // Interval ends of a feature, indexed by cell.
  const std::uint16_t* low(Part part, int channel, Feature feature, int row) const {
    return maps_[map_of(part, channel, feature)].low.data() + base_[static_cast<std::size_t>(row)];
  }
  const std::uint16_t* high(Part part, int channel, Feature feature, int row) const {
    return maps_[map_of(part, channel, feature)].high.data() + base_[static_cast<std::size_t>(row)];
  }

  // Finds anew which places are free, from what is blocked; as make() does. kCancelled: half of them are found.
  Status find_places(const Raster<PanelFrame>& picture, const BlockedPixels& blocked, Millimetres border,
                     const std::stop_token& stop);
  // Clears the places whose outline would overlap `taken`, an outline already grown by the kerf (grown_rings()).
  void remove(const std::vector<Ring<PanelFrame>>& taken, const Raster<PanelFrame>& picture, Millimetres kerf);
  std::size_t bytes() const;

 private:
  CellIndex(const RotatedPanel& panel, const WindowClass& windows);
  struct Intervals {
    std::vector<std::uint16_t> low, high;
  };
  std::size_t map_of(Part part, int channel, Feature feature) const {
    return (static_cast<std::size_t>(part) * static_cast<std::size_t>(channels_) + static_cast<std::size_t>(channel)) *
               kFeatures +
           static_cast<std::size_t>(feature);
  }
  void find_rows(const RotatedPanel& panel);
  Status measure(const RotatedPanel& panel, Part part, const std::stop_token& stop);
  void store_row(const RowExtremes& extremes, Part part, int channel, std::size_t row, double scale);
  void find_alive_cells();

  Lattice lattice_;
  WindowClass windows_;
  int channels_;
  std::vector<std::ptrdiff_t> base_;  // of each cell row, so that base + cell is an index
  std::vector<int> begin_, end_;      // cells of each row that have features
  std::vector<int> alive_begin_, alive_end_;
  std::vector<std::uint32_t> places_;
  std::vector<Intervals> maps_;
};

}  // namespace veneer::planner
