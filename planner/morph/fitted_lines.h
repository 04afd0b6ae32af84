// The lines of a morphed grid: splines through its vertices, fitted to the picture's edges (paper, section 3.4).
//
// The paper fits curves to the edge image where one runs near. Here a line goes where the patches on both of its sides
// become as uniform in tone as they can, which is at the picture's edges, by the dynamic programming of the refinement
// (cut_lines.h) with each patch's own tone in place of wood. Between, a line is as straight as it can be. So
// curves are smooth across vertices (of second order, G2), and lines turn by at most 40 degrees. Pixels of one raster
// over the artwork, y down. Pure functions, the same for any number of threads.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/boundaries/cut_lines.h"
#include "planner/morph/spring_grid.h"

namespace veneer::planner {

// The lines of the straight grid, in order: upright ones from the left, then level ones from above. Faces are in
// reading order.
CutLines grid_lines(const GridSize& size, cv::Size raster);

// Natural cubic splines through the vertices.
CutLines lines_through(const SpringGrid& grid, CutLines straight);

// Of cells that are to be cut in two, both tones; none: a cell shows one.
using HalfTones = std::vector<std::optional<std::array<double, 2>>>;

struct FitOptions {
  double reach = 0;  // how far lines may come from where the straight grid has them
  double gap = 0;    // least width of a patch, straight across
  int threads = 1;
  cv::Mat counts{};    // CV_8UC1 of the raster's size: where tones count, not 0; empty: everywhere
  HalfTones halves{};  // one a face; empty: all faces show one tone
};

// Bends the two lines that meet in each of these vertices so that they meet in it, near by and no more than they must.
// No two of them are nearer than some pixels to each other.
void lead_through(std::span<const PlanePin> pins, const GridSize& size, CutLines& lines);

// `tones`: CV_32FC1 of the raster's size, any scale. kCancelled: a stop was requested.
Result<CutLines> fitted_to_tones(CutLines lines, const cv::Mat& tones, const FitOptions& options,
                                 const std::stop_token& stop = {});

}  // namespace veneer::planner
