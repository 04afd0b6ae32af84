// The borders of a rectangular partition as lines over the artwork's pixels, and the cheapest way of each by dynamic
// programming (paper, section 3.4, equations 8 and 9).
//
// A line is the longest straight run of borders: a whole grid line, or between T-junctions where patches have several
// sizes. It is a function of the pixels along it. One line is moved at a time while all others stay, columns and rows
// in turn; crossings need no special case, because a pixel's patch is found from all four lines around it. Lines turn
// by less than 45 degrees from upright or level, so an upright line and a level one cross once. A morphed grid's lines
// (planner/morph) are curved from the start, which changes nothing but where their home is.
// Lengths are pixels of the working resolution, rows from above. Pure functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <utility>
#include <vector>

namespace veneer::planner {

struct CutLine {
  bool upright = false;          // else level; along: rows of an upright line, columns of a level one
  double straight = 0;           // where the grid has it
  double begin = 0, end = 0;     // of the line, along
  int first = 0;                 // pixel along that `at` begins with: somewhat before `begin`, for its neighbours' sake
  std::vector<double> at;        // how far across, in the middle of each pixel along
  std::vector<double> curved{};  // where the layout has it, like `at`; empty: at `straight`
  // Where it has to pass, within about a pixel: along, across.
  std::vector<std::pair<double, double>> through{};

  // Anywhere along; beyond the known pixels as at the last one.
  double operator()(double along) const;
  // Where the layout has it.
  double home(std::size_t i) const { return curved.empty() ? straight : curved[i]; }
};

// The lines around a face, as numbers; kBorder: the artwork's border.
struct FaceLines {
  static constexpr int kBorder = -1;
  int left = kBorder, right = kBorder, top = kBorder, bottom = kBorder;
};

// A rectangle of the partition.
struct PixelRectangle {
  double left = 0, top = 0, right = 0, bottom = 0;
};

struct CutLines {
  int columns = 0, rows = 0;     // of the artwork's working picture
  double width = 0, height = 0;  // of the artwork itself
  std::vector<CutLine> lines;
  std::vector<FaceLines> faces;

  // The borders of a face, where the other direction is `along`.
  double left(std::size_t face, double row) const { return side(faces[face].left, row, 0); }
  double right(std::size_t face, double row) const { return side(faces[face].right, row, width); }
  double top(std::size_t face, double column) const { return side(faces[face].top, column, 0); }
  double bottom(std::size_t face, double column) const { return side(faces[face].bottom, column, height); }

 private:
  double side(int line, double along, double border) const {
    return line == FaceLines::kBorder ? border : lines[static_cast<std::size_t>(line)](along);
  }
};

// The lines of rectangles that cover `width` x `height` pixels without gaps and overlaps, all straight. `reach`: how
// far lines are going to move.
CutLines cut_lines(std::span<const PixelRectangle> rectangles, double width, double height, cv::Size picture,
                   double reach);

// What it costs to give each pixel to a face: CV_32FC1 over `window`; no pixel outside it may be given to it.
struct FaceCost {
  cv::Rect window;
  cv::Mat cost;
};
// For pixels that a face may not have.
inline constexpr float kForbidden = 1e4F;

struct CutOptions {
  double reach = 0;   // how far a line may go from where the layout has it
  double gap = 0;     // kept between the two lines on either side of a face, measured straight across
  double corner = 0;  // how far from where lines meet smooth ones keep to angles of 45 degrees and more
  double bend = 0;    // cost of each pixel that a line goes aside
};

// Moves line `number` to where the two faces at each of its pixels cost least.
void reroute(CutLines& lines, std::size_t number, std::span<const FaceCost> costs, const CutOptions& options);
// All upright lines, then all level ones, `rounds` times.
void reroute_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, int rounds);
// Moves all lines to where they cost least of all lines that are smooth: splines with a control every `stride` pixels,
// whose turns there, in sixths of the stride, cost their squares times `bend`.
void smooth_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, double stride, double bend,
                int rounds);

}  // namespace veneer::planner
