// Decorative mosaics (Hausner 2001) as gap-free cells: each cell is what one tile of the mosaic and the joints around
// it cover, turned along the nearest edge of the picture.
//
// Everything is in pixels of one raster over the artwork; the rasters given have its size. Pure functions of their
// arguments, whatever the number of threads.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/disjoint_tiles.h"

namespace veneer::planner {

// The size map (section 5.2): where `detail` (CV_32FC1, any scale) is large, tiles are small, the largest `ratio` times
// as large as the smallest. Only the order of the details counts. Sizes change gradually, over about a tile, and are
// such that `count` tiles fill the raster. CV_32FC1, sides in pixels.
cv::Mat tile_sizes(const cv::Mat& detail, int count, double ratio);

// The same by what somebody painted: `painted` is CV_8UC1, of the raster; tiles go from the smallest where it is white
// to the largest, `ratio` times as large, where it is black, evenly by factors.
cv::Mat painted_tile_sizes(const cv::Mat& painted, int count, double ratio);

struct MosaicOptions {
  int count = 1;      // of tiles
  double aspect = 1;  // tiles are so many times as long, along the nearest edge, as wide (section 5.3); from 1
  std::uint64_t seed = 1;
  int threads = 1;
  // CV_8UC1, 255 on lines one pixel wide that somebody drew: they count as edges of the picture, whose own ones do not
  // count beside them, or, with `lines_only`, not at all. Empty: there are none.
  cv::Mat lines{};
  bool lines_only = false;
};

struct MosaicFigures {
  int tiles = 0;            // that were placed
  int iterations = 0;       // of Lloyd's method
  double mean_move_px = 0;  // of the last iteration before the joints were closed
  // Median over the tiles, between the field where a tile's site is and its mean over the tile's cell: how much the
  // field turns within tiles. Of the cells' shapes it knows nothing.
  double deviation_deg = 0;
  double cell_deviation_deg = 0;      // see cell_deviation(), of the cells as they are in the end
  double straddling = 0;              // share of the cells that an edge of the picture runs through
  std::vector<PlanePoint> turning{};  // see turning_cells()
  friend bool operator==(const MosaicFigures&, const MosaicFigures&) = default;
};

// Degrees between a cell's sides, those of the smallest rectangle around it, and the mean of the field over it, up to
// quarter turns: the median over the cells, so from 0 to 45, and about 22.5 where cells are turned by chance. `labels`:
// CV_32SC1, one number a cell. `angle`: the field, CV_32FC1, radians.
double cell_deviation(const cv::Mat& labels, const cv::Mat& angle);

// The cells that cannot follow the field, because it turns by kTurningDegrees or more within them: where two edges of
// other directions are as near, about the end of one, or in a bend that is narrower than a tile (sections 3 and 5.2).
// Their middles, in shares of the raster's sides, from the upper left.
inline constexpr double kTurningDegrees = 45;  // as far as a square can be turned from anything
std::vector<PlanePoint> turning_cells(const cv::Mat& labels, const cv::Mat& angle);

struct Mosaic {
  cv::Mat labels;                   // CV_32SC1: the tile of each pixel
  std::vector<DisjointTile> tiles;  // the same with joints, as the paper has them
  TileFigures tile_figures;
  MosaicFigures figures;
};

// `bgr`: the picture, CV_8UC3. `size`: see tile_sizes(). kCancelled: a stop was requested.
Result<Mosaic> decorative_mosaic(const cv::Mat& bgr, const cv::Mat& size, const MosaicOptions& options,
                                 const std::stop_token& stop = {});

}  // namespace veneer::planner
