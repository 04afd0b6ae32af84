// The tiles of a mosaic with joints between them, as the paper has them (Hausner 2001, sections 5.1 to 5.3): rectangles
// that keep apart, one in each cell, along the direction field.
//
// Everything is in pixels of one raster over the artwork, x from its left, y from its top. Pure functions.
#pragma once

#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/layout/bezier_fit.h"
#include "planner/layout/centroidal_voronoi.h"

namespace veneer::planner {

struct DisjointTile {
  PlanePoint middle;
  double angle = 0;  // of its length: radians from +x towards +y
  double length = 0, width = 0;
};

// How far a tile reaches, in sides of its cell: the paper's delta.
inline constexpr double kTileShare = 0.8;

// One in the middle of each cell, in the order of their numbers. Cells end at edges, so their middles lie beside them,
// where a site, which joints drew back, may lie on one. A tile whose cell came out smaller than was wished is as small
// as that. One of which more than a twentieth lies beyond its cell is moved, and made smaller, until that is so, to no
// less than three fifths of its sides. `labels`: CV_32SC1, the number of each pixel's cell. `aspect`: length to width,
// as the cells were made with.
std::vector<DisjointTile> disjoint_tiles(const cv::Mat& labels, const VoronoiField& field, double aspect);

// An edge that runs farther than this inside a cell or tile, in its narrow sides, for so long, in sides of a square as
// large, straddles it.
inline constexpr double kStraddlingDepth = 0.2, kStraddlingLength = 0.5;

// How tiles came out.
struct TileFigures {
  double coverage = 0;       // share of the raster that tiles cover
  double overlap = 0;        // share of the tiles' area that lies on another tile's
  double deviation_deg = 0;  // median over the tiles, between a tile's sides and the field's mean over the tile
  double straddling = 0;     // share of the tiles that an edge runs through
  friend bool operator==(const TileFigures&, const TileFigures&) = default;
};
// `angle`: the field, CV_32FC1. `edges`: CV_8UC1, 255 on lines one pixel wide. kCancelled: a stop was requested.
Result<TileFigures> tile_figures(const std::vector<DisjointTile>& tiles, const cv::Mat& angle, const cv::Mat& edges,
                                 const std::stop_token& stop = {});

}  // namespace veneer::planner
