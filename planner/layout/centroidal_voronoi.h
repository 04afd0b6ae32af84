// Centroidal Voronoi diagrams of square pyramids that follow a direction field (Hausner 2001, section 3).
//
// Symbols of the paper: sites P_i, field phi, size 1 / alpha, aspect beta. The pyramid over a site has square sections
// with sides along phi(P_i): z = alpha max(beta |u|, |v| / beta), where u and v are the distances along phi and across
// it. That is the Manhattan metric with axes an eighth of a turn from phi; with axes along phi, tiles come to rest on
// their corners, since a cell takes the shape of the metric's own discs.
// A pixel belongs to the site whose pyramid is lowest there, of several to the one with the lowest number; where whole
// areas are as near to two sites, a small Euclidean share of the height decides. Lloyd's method moves each site to the
// centroid of its cell until they rest. Pure function of its arguments, whatever the number of threads.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/layout/bezier_fit.h"

namespace veneer::planner {

struct VoronoiField {
  cv::Mat angle;  // CV_32FC1: phi, radians from +x towards +y, y down; of any axis of the tiles
  cv::Mat size;   // CV_32FC1: wished side of a tile, pixels
  cv::Mat avoid;  // CV_8UC1: pixels that count for no centroid, so that cells leave them (section 6); empty: none
};

struct VoronoiOptions {
  int count = 0;      // of sites
  double beta = 1;    // tiles are beta times as long across phi, 1 / beta times along it (section 5.3)
  double rest = 0.1;  // sites rest when they move by less than so many pixels on the mean
  int most_iterations = 400;
  std::uint64_t seed = 1;
  int threads = 1;
};

struct VoronoiDiagram {
  std::vector<PlanePoint> sites;  // pixels
  cv::Mat labels;                 // CV_32SC1: the number of each pixel's site
  int iterations = 0;
  double mean_move = 0;  // of the last iteration, pixels
};

// Sites drawn at random, the denser the smaller tiles are to be (rejection sampling, section 5.2).
std::vector<PlanePoint> sampled_sites(const cv::Mat& size, int count, std::uint64_t seed);

// Lloyd's method from these sites. kCancelled: a stop was requested.
Result<VoronoiDiagram> centroidal_voronoi(std::vector<PlanePoint> sites, const VoronoiField& field,
                                          const VoronoiOptions& options, const std::stop_token& stop = {});

}  // namespace veneer::planner
