// Decorative mosaics (Hausner 2001) as gap-free cells: each cell is what one tile of the mosaic and the joints around
// it cover, turned along the nearest edge of the picture.
//
// Everything is in pixels of one raster over the artwork; the rasters given have its size. Pure functions of their
// arguments, whatever the number of threads.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stop_token>

#include "base/result.h"

namespace veneer::planner {

// The size map (section 5.2): where `detail` (CV_32FC1, any scale) is large, tiles are small, the largest `ratio` times
// as large as the smallest. Only the order of the details counts. Sizes change gradually, over about a tile, and are
// such that `count` tiles fill the raster. CV_32FC1, sides in pixels.
cv::Mat tile_sizes(const cv::Mat& detail, int count, double ratio);

struct MosaicOptions {
  int count = 1;      // of tiles
  double aspect = 1;  // tiles along edges are so many times as long as wide (section 5.3)
  std::uint64_t seed = 1;
  int threads = 1;
};

struct MosaicFigures {
  int tiles = 0;            // that were placed
  int iterations = 0;       // of Lloyd's method
  double mean_move_px = 0;  // of the last iteration before the joints were closed
  // Median over the tiles, between the field where a tile's site is and its mean over the tile's cell: how much the
  // field turns within tiles. Of the cells' shapes it knows nothing.
  double deviation_deg = 0;
  double cell_deviation_deg = 0;  // see cell_deviation(), of the cells as they are in the end
  double straddling = 0;          // share of the cells that an edge of the picture runs through
  friend bool operator==(const MosaicFigures&, const MosaicFigures&) = default;
};

// Degrees between a cell's sides, those of the smallest rectangle around it, and the mean of the field over it, up to
// quarter turns: the median over the cells, so from 0 to 45, and about 22.5 where cells are turned by chance. `labels`:
// CV_32SC1, one number a cell. `angle`: the field, CV_32FC1, radians.
double cell_deviation(const cv::Mat& labels, const cv::Mat& angle);

struct Mosaic {
  cv::Mat labels;  // CV_32SC1: the tile of each pixel
  MosaicFigures figures;
};

// `bgr`: the picture, CV_8UC3. `size`: see tile_sizes(). kCancelled: a stop was requested.
Result<Mosaic> decorative_mosaic(const cv::Mat& bgr, const cv::Mat& size, const MosaicOptions& options,
                                 const std::stop_token& stop = {});

}  // namespace veneer::planner
