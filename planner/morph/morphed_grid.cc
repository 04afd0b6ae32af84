#include "planner/morph/morphed_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "base/polygon_ops.h"
#include "planner/boundaries/curved_layout.h"
#include "planner/boundaries/draw_back.h"
#include "planner/cancelled.h"
#include "planner/layout/grid.h"
#include "planner/morph/edge_image.h"
#include "planner/morph/fitted_lines.h"
#include "planner/morph/spring_grid.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr double kLongestSide = 1000;   // pixels of the raster
constexpr double kCellPixels = 28;      // side of a patch in it, where that makes it smaller
constexpr double kLeastCellPixels = 8;  // the same, of very many
constexpr double kMorphReach = 0.45;    // of a patch: how far lines may come from the straight grid
constexpr double kSlanted = 1.25;       // of a width: what lines that run aslant need straight across
constexpr double kNarrowest = 0.4;      // of a patch, at most, that is kept straight across
constexpr double kRelaxBy = 0.5;        // where something is wrong
constexpr Millimetres kNearFault{1};
constexpr int kWholeCellsAfter = 3, kStraightAfter = 6, kRelaxations = 10;

class Morph {
 public:
  Morph(const cv::Mat& bgr, const cv::Mat& tones, Millimetres width, const PixelGrid& grid, const MorphOptions& options)
      : bgr_(bgr),
        tones_(tones),
        width_(width),
        height_(grid.height),
        grid_(grid),
        options_(options),
        size_(grid_size(width, grid.height, options.patch)) {
    const double longer = std::max(width.count(), height_.count());
    const double patch = options.patch.count();
    px_per_mm_ = std::max(std::min(kLongestSide / longer, kCellPixels / patch), kLeastCellPixels / patch);
    const auto pixels = [&](Millimetres side) {
      return std::max(2, static_cast<int>(std::lround(side.count() * px_per_mm_)));
    };
    raster_ = {pixels(width), pixels(height_)};
  }

  Result<MorphedGrid> run(const std::stop_token& stop) {
    straight_ = grid_lines(size_, raster_);
    const EdgeImage edges = edge_image(resized(bgr_), spacing(), options_.threads);
    if (stop.stop_requested()) return cancelled();
    MorphedGrid out{
        partition_of(width_, height_, grid_layout(width_, height_, options_.patch)), at_work(straight_), {}};
    // What is too small to be cut as a square is not bent.
    if (edges.empty() || fault(outline_of(out.partition, 0)).found) return out;
    const SpringGrid springs = spring_grid(size_, raster_.width, raster_.height, edges);
    cv::Mat tones;
    resized(tones_).convertTo(tones, CV_32F, 1.0 / 255);
    const double patch = options_.patch.count() * px_per_mm_;
    const double gap = std::max(options_.limits.width.count() * kSlanted,
                                std::min(options_.size.count(), options_.patch.count() * kNarrowest)) *
                       px_per_mm_;
    Result<CutLines> fitted =
        fitted_to_tones(lines_through(springs, straight_), tones, {kMorphReach * patch, gap, options_.threads}, stop);
    if (!fitted.ok()) return fitted.error();
    return fabricable(*fitted, edges, std::move(out), stop);
  }

 private:
  double spacing() const { return std::sqrt(raster_.area() / (static_cast<double>(size_.rows) * size_.columns)); }

  cv::Mat resized(const cv::Mat& picture) const {
    cv::Mat out;
    const bool shrinks = raster_.area() < picture.size().area();
    cv::resize(picture, out, raster_, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_CUBIC);
    return out;
  }

  // Lines over the raster as lines over the working pixels.
  CutLines at_work(const CutLines& lines) const {
    const ScanResolution& work = grid_.resolution;
    CutLines out{working_pixels(width_, work),
                 working_pixels(height_, work),
                 work.to_px(width_).count(),
                 work.to_px(height_).count(),
                 lines.lines,
                 lines.faces};
    const double x = out.width / lines.width, y = out.height / lines.height;
    for (CutLine& line : out.lines) {
      const CutLine from = line;
      const double across = line.upright ? x : y, along = line.upright ? y : x;
      line.straight *= across, line.begin *= along, line.end *= along, line.first = 0;
      line.at.resize(static_cast<std::size_t>(line.upright ? out.rows : out.columns));
      for (std::size_t i = 0; i < line.at.size(); ++i)
        line.at[i] = from((static_cast<double>(i) + 0.5) / along) * across;
    }
    return out;
  }

  // The grid as it is `wanted`, or as near to it as its cells are fabricable. `out`: the straight one.
  Result<MorphedGrid> fabricable(const CutLines& wanted, const EdgeImage& edges, MorphedGrid out,
                                 const std::stop_token& stop) const {
    Shares shares = whole_way(wanted);
    std::vector<char> relaxed(wanted.faces.size(), 0);
    for (int back = 0; back <= kRelaxations; ++back) {
      if (stop.stop_requested()) return cancelled();
      const CutLines lines = between(straight_, wanted, shares);
      CutLines work = at_work(lines);
      Partition partition = curved_layout(work, width_, grid_, options_.smoothness);
      const std::vector<Fault> bad = faults(partition);
      const Shares before = shares;
      bool sound = true;
      for (std::size_t f = 0; f < bad.size(); ++f) {
        if (!bad[f].found) continue;
        sound = false, relaxed[f] = 1;
        const bool all = bad[f].everywhere || back >= kWholeCellsAfter;
        if (all) draw_back(wanted, f, back >= kStraightAfter ? 0 : kRelaxBy, shares);
        for (const PlanePoint& p : bad[f].places)
          if (!all) draw_back_near(wanted, f, p, kNearFault.count() * px_per_mm_, kRelaxBy, before, shares);
      }
      if (!sound) continue;
      out.partition = std::move(partition), out.lines = std::move(work);
      break;
    }
    for (CutLine& line : out.lines.lines) line.curved = line.at;
    out.figures = figures(out, edges);
    out.figures.relaxed = static_cast<std::size_t>(std::count(relaxed.begin(), relaxed.end(), 1));
    return out;
  }

  struct Fault {
    bool found = false, everywhere = false;
    std::vector<PlanePoint> places;  // pixels of the raster
  };
  Fault fault(const Ring<ArtworkFrame>& outline) const {
    Fault out;
    std::vector<Point<ArtworkFrame>> places;
    const auto why = fault_of(outline, options_.limits, &places);
    const bool small = offset(Region<ArtworkFrame>(outline), options_.size / -2.0, Corners::kRound).empty();
    out.found = why || small;
    out.everywhere = small || (why && (*why != FabricationFault::kThin || places.empty()));
    for (const auto& p : places) out.places.push_back({p.x.count() * px_per_mm_, (height_ - p.y).count() * px_per_mm_});
    return out;
  }
  std::vector<Fault> faults(const Partition& partition) const {
    std::vector<Fault> out(partition.faces.size());
    (void)run_parallel(out.size(), options_.threads, {},
                       [&](std::size_t f) { out[f] = fault(outline_of(partition, f)); });
    return out;
  }

  // Where lines are, over the raster of the edges, and a pixel around them.
  cv::Mat borders(const CutLines& lines) const {
    cv::Mat out(raster_, CV_8UC1, cv::Scalar(0));
    const double x = raster_.width / lines.width, y = raster_.height / lines.height;
    for (const CutLine& line : lines.lines) {
      const int count = line.upright ? raster_.height : raster_.width;
      for (int i = 0; i < count; ++i) {
        const double at = line((i + 0.5) / (line.upright ? y : x)) * (line.upright ? x : y);
        for (const int near : {-1, 0, 1}) {
          const int across = static_cast<int>(std::floor(at)) + near;
          if (std::abs(across + 0.5 - at) > 1 || across < 0 || across >= (line.upright ? out.cols : out.rows)) continue;
          (line.upright ? out.at<std::uint8_t>(i, across) : out.at<std::uint8_t>(across, i)) = 255;
        }
      }
    }
    return out;
  }

  MorphFigures figures(const MorphedGrid& made, const EdgeImage& edges) const {
    MorphFigures out;
    const cv::Mat all = edges.upright | edges.level;
    const double count = cv::countNonZero(all);
    out.edges_before = cv::countNonZero(all & borders(straight_)) / count;
    out.edges_after = cv::countNonZero(all & borders(made.lines)) / count;
    // Each edge's ends are vertices; those of a grid have two to four edges each, so that each is looked at once.
    std::map<std::pair<int, int>, Millimetres> moves;
    const auto note = [&](const Point<ArtworkFrame>& at) {
      const double dx = (width_ / size_.columns).count(), dy = (height_ / size_.rows).count();
      const double column = std::round(at.x.count() / dx), row = std::round(at.y.count() / dy);
      moves[{static_cast<int>(column), static_cast<int>(row)}] =
          Millimetres(std::hypot(at.x.count() - column * dx, at.y.count() - row * dy));
    };
    for (const PartitionEdge& edge : made.partition.edges) note(edge.curve.front()), note(edge.curve.back());
    for (const auto& [vertex, move] : moves) {
      out.mean_move += move / static_cast<double>(moves.size());
      out.most_move = std::max(out.most_move, move);
    }
    return out;
  }

  const cv::Mat &bgr_, &tones_;
  Millimetres width_, height_;
  const PixelGrid& grid_;
  const MorphOptions& options_;
  GridSize size_;
  double px_per_mm_ = 1;
  cv::Size raster_;
  CutLines straight_;
};

}  // namespace

Result<MorphedGrid> morphed_grid(const cv::Mat& bgr, const cv::Mat& tones, Millimetres width, const PixelGrid& grid,
                                 const MorphOptions& options, const std::stop_token& stop) {
  return Morph(bgr, tones, width, grid, options).run(stop);
}

}  // namespace veneer::planner
