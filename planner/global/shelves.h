// Equal rectangles side by side in rows, on the free wood of one panel at one rotation: as many as rows can hold.
//
// Looks at a grid of points, turned like the rectangles and about a pixel apart: a rectangle fits where all points
// inside it are free (so a corner of a blocked pixel may be missed). Streams over the grid's rows, so that nothing as
// large as the panel is stored. Not thread-safe.
#pragma once

#include <stop_token>
#include <vector>

#include "base/raster.h"
#include "base/result.h"
#include "planner/poses/footprint.h"

namespace veneer::planner {

// A rectangle as it counts against others, in pixels of the stock's raster.
struct Spacing {
  double width, height;
};

class Shelves {
 public:
  // `free`: non-zero is free; outlives this. `turn` is that of panel_from_artwork.
  Shelves(const Raster<PanelFrame>& free, int panel, Radians turn, const Spacing& spacing);

  // Region by region, a region being wood that rectangles can cover without a break: poses of rectangles' centres. Each
  // region has the rows that hold most. kCancelled: a stop was requested.
  Result<std::vector<std::vector<Pose>>> filled(const std::stop_token& stop);

 private:
  // Rectangles whose upper left point is one of [first, last] of a row fit.
  struct Run {
    int row, first, last;
    std::size_t region;
  };
  bool is_free(double column, double row) const;
  Status find_runs(const std::stop_token& stop);
  void add_run(Run run);
  std::size_t root(std::size_t region);
  Result<std::vector<Pose>> fill(const std::vector<Run>& runs, const std::stop_token& stop) const;
  Pose pose(int left, int top) const;

  const Raster<PanelFrame>& free_;
  int panel_;
  double angle_, cos_, sin_;
  int across_, down_;       // steps a rectangle
  double step_x_, step_y_;  // pixels
  double left_, top_;       // of the grid, in turned pixels
  int columns_ = 0, rows_ = 0;
  std::vector<Run> runs_;             // from the top
  std::vector<std::size_t> parents_;  // of regions that have become one
  std::vector<int> covered_;          // per column: up to which row
  std::vector<std::size_t> coverer_;  // and by which region
};

}  // namespace veneer::planner
