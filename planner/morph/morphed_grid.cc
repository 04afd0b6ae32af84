#include "planner/morph/morphed_grid.h"

#include <fmt/format.h>

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
#include "planner/morph/fitted_lines.h"
#include "planner/morph/split_cells.h"
#include "planner/morph/spring_grid.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kPale = 128;              // grey of what counts in a mask
constexpr double kLongestSide = 1000;   // pixels of the raster
constexpr double kCellPixels = 28;      // side of a patch in it, where that makes it smaller
constexpr double kLeastCellPixels = 8;  // the same, of very many
constexpr double kCoarseCellPixels = 12;
constexpr double kMorphReach = 0.45;  // of a patch: how far lines may come from the straight grid
constexpr double kSlanted = 1.25;     // of a width: what lines that run aslant need straight across
constexpr double kNarrowest = 0.4;    // of a patch, at most, that is kept straight across
constexpr double kRelaxBy = 0.5;      // where something is wrong
constexpr Millimetres kNearFault{1};
constexpr int kWholeCellsAfter = 3, kStraightAfter = 6, kRelaxations = 10;

class Morph {
 public:
  Morph(const cv::Mat& bgr, const cv::Mat& tones, Millimetres width, const PixelGrid& grid, const MorphOptions& options,
        double cell_pixels = kCellPixels)
      : bgr_(bgr),
        tones_(tones),
        width_(width),
        height_(grid.height),
        grid_(grid),
        options_(options),
        size_(grid_size(width, grid.height, options.patch)) {
    const double longer = std::max(width.count(), height_.count());
    const double patch = options.patch.count();
    px_per_mm_ = std::max(std::min(kLongestSide / longer, cell_pixels / patch), kLeastCellPixels / patch);
    const auto pixels = [&](Millimetres side) {
      return std::max(2, static_cast<int>(std::lround(side.count() * px_per_mm_)));
    };
    raster_ = {pixels(width), pixels(height_)};
  }

  Result<MorphedGrid> run(const std::stop_token& stop) {
    if (Status status = place_pins(); !status.ok()) return status.error();
    straight_ = base_ = grid_lines(size_, raster_);
    const EdgeMasks masks{mask_of(options_.guides.large), mask_of(options_.guides.fine)};
    const EdgeImage edges = edges_that_count(options_.edges(resized(bgr_), spacing(), options_.threads), masks);
    if (stop.stop_requested()) return cancelled();
    MorphedGrid out{
        partition_of(width_, height_, grid_layout(width_, height_, options_.patch)), at_work(straight_), {}};
    if (edges.empty() && pins_.empty()) return out;
    // What is too small to be cut as a square is not bent.
    if (fault(outline_of(out.partition, 0)).found) {
      if (pins_.empty()) return out;
      return unusable(
          "patches that are too small to be cut with curved borders cannot have pinned vertices: choose "
          "larger ones or a smaller least width");
    }
    cv::Mat tones;
    resized(tones_).convertTo(tones, CV_32F, 1.0 / 255);
    if (!pins_.empty()) {
      base_ = lines_through(spring_grid(size_, raster_.width, raster_.height, {}, pins_), straight_);
      lead_through(pins_, size_, base_);
    }
    Result<CutLines> wanted = edges.empty() ? base_ : fitted(edges, tones, masks, stop);
    if (!wanted.ok()) return wanted.error();
    Result<MorphedGrid> made = fabricable(*wanted, edges, std::move(out), stop);
    if (made.ok() && options_.triangles) {
      SplitCells cells = split(made->partition, tones, edges);
      made->partition = std::move(cells.partition), made->figures.split = cells.count;
      made->figures.edges_after = share_on(edges, borders(made->lines) | borders(cells.cuts));
    }
    return made;
  }

  Result<GridPreview> coarse(const std::stop_token& stop) {
    if (Status status = place_pins(); !status.ok()) return status.error();
    const EdgeMasks masks{mask_of(options_.guides.large), mask_of(options_.guides.fine)};
    const EdgeImage edges = edges_that_count(options_.edges(resized(bgr_), spacing(), options_.threads), masks);
    if (stop.stop_requested()) return cancelled();
    CutLines lines =
        lines_through(spring_grid(size_, raster_.width, raster_.height, edges, pins_), grid_lines(size_, raster_));
    lead_through(pins_, size_, lines);
    return grid_preview(lines, size_, width_, height_);
  }

 private:
  SplitCells split(const Partition& cells, const cv::Mat& tones, const EdgeImage& edges) const {
    return split_cells(cells, tones, edges.upright | edges.level, {ScanResolution{px_per_mm_}, height_},
                       {options_.limits, options_.size, options_.threads});
  }

  // Lines on the edges, between them as straight as they can be.
  Result<CutLines> fitted(const EdgeImage& edges, const cv::Mat& tones, const EdgeMasks& masks,
                          const std::stop_token& stop) const {
    const SpringGrid springs = spring_grid(size_, raster_.width, raster_.height, edges, pins_);
    const double patch = options_.patch.count() * px_per_mm_;
    const double gap = std::max(options_.limits.width.count() * kSlanted,
                                std::min(options_.size.count(), options_.patch.count() * kNarrowest)) *
                       px_per_mm_;
    CutLines lines = lines_through(springs, straight_);
    for (const PlanePin& pin : pins_) {
      if (pin.column > 0 && pin.column < size_.columns)
        lines.lines[static_cast<std::size_t>(pin.column - 1)].through.emplace_back(pin.at.y, pin.at.x);
      if (pin.row > 0 && pin.row < size_.rows)
        lines.lines[static_cast<std::size_t>(size_.columns - 1 + pin.row - 1)].through.emplace_back(pin.at.x, pin.at.y);
    }
    // Where edges do not count, tones do not either.
    cv::Mat counts;
    if (!masks.large.empty() && !masks.fine.empty()) counts = masks.large | masks.fine;
    FitOptions fit{kMorphReach * patch, gap, options_.threads, counts};
    // No line need bend to an edge along which a cell is going to be cut.
    if (options_.triangles)
      fit.halves = split(curved_layout(at_work(lines), width_, grid_, options_.smoothness), tones, edges).tones;
    Result<CutLines> out = fitted_to_tones(std::move(lines), tones, fit, stop);
    if (!out.ok()) return out;
    for (CutLine& line : out->lines) line.through.clear();
    lead_through(pins_, size_, *out);
    return out;
  }

  // The mask over the raster; empty: all edges count.
  cv::Mat mask_of(const cv::Mat& drawn) const {
    if (drawn.empty()) return {};
    return resized(drawn) >= kPale;
  }

  // kInvalidArgument: see morphed_grid().
  Status place_pins() {
    const double dx = width_.count() / size_.columns, dy = height_.count() / size_.rows;
    const auto refuse = [](const PinnedVertex& it, const std::string& why) {
      return unusable(fmt::format("the vertex pinned in row {}, column {} at {:.2f}, {:.2f} mm {}", it.row, it.column,
                                  it.at.x.count(), it.at.y.count(), why));
    };
    std::map<std::pair<int, int>, PinnedVertex> known;
    for (const PinnedVertex& it : options_.guides.vertices) {
      if (it.row < 0 || it.column < 0 || it.row > size_.rows || it.column > size_.columns)
        return refuse(
            it, fmt::format("is none of the grid's: rows are 0 to {}, columns 0 to {}", size_.rows, size_.columns));
      if (!known.emplace(std::pair(it.row, it.column), it).second) return refuse(it, "is pinned twice");
      const double x = it.at.x.count() - it.column * dx, y = it.at.y.count() - (height_.count() - it.row * dy);
      const bool on_side = it.column == 0 || it.column == size_.columns, on_end = it.row == 0 || it.row == size_.rows;
      constexpr double kOnBorder = 1e-3;  // mm
      if ((on_side && !(std::abs(x) <= kOnBorder)) || (on_end && !(std::abs(y) <= kOnBorder)))
        return refuse(it, "belongs to the artwork's border and must stay on it, corners where they are");
      if (!(std::abs(x) <= kFarthest * dx && std::abs(y) <= kFarthest * dy))
        return refuse(it, fmt::format("is too far from where the straight grid has it, {:.2f}, {:.2f} mm: it may come "
                                      "{:.2f} mm across and {:.2f} mm up or down",
                                      it.column * dx, height_.count() - it.row * dy, kFarthest * dx, kFarthest * dy));
      pins_.push_back({it.row,
                       it.column,
                       {it.at.x.count() / width_.count() * raster_.width,
                        (1 - it.at.y.count() / height_.count()) * raster_.height}});
    }
    // Of two next to each other.
    for (const auto& [place, it] : known) {
      const auto below = known.find({place.first + 1, place.second}),
                 beside = known.find({place.first, place.second + 1});
      if (below != known.end() && std::abs((below->second.at.x - it.at.x).count()) > kMostLean * dy)
        return refuse(it, "lies too far aside of the one pinned below it: their border would lean too much");
      if (beside != known.end() && std::abs((beside->second.at.y - it.at.y).count()) > kMostLean * dx)
        return refuse(it, "lies too far above or below the one pinned beside it: their border would lean too much");
    }
    return Ok();
  }

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

  CutLines led_at_work(const CutLines& lines) const {
    CutLines out = at_work(lines);
    std::vector<PlanePin> pins = pins_;
    for (PlanePin& pin : pins) pin.at.x *= out.width / lines.width, pin.at.y *= out.height / lines.height;
    lead_through(pins, size_, out);
    return out;
  }

  // The grid as it is `wanted`, or as near to it as its cells are fabricable. `out`: the straight one.
  Result<MorphedGrid> fabricable(const CutLines& wanted, const EdgeImage& edges, MorphedGrid out,
                                 const std::stop_token& stop) const {
    Shares shares = whole_way(wanted);
    std::vector<char> relaxed(wanted.faces.size(), 0);
    bool made = false;
    for (int back = 0; back <= kRelaxations; ++back) {
      if (stop.stop_requested()) return cancelled();
      CutLines work = led_at_work(between(base_, wanted, shares));
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
      out.partition = std::move(partition), out.lines = std::move(work), made = true;
      break;
    }
    if (!made && !pins_.empty()) {
      out.lines = led_at_work(base_);
      out.partition = curved_layout(out.lines, width_, grid_, options_.smoothness);
      const std::vector<Fault> bad = faults(out.partition);
      const auto first = std::find_if(bad.begin(), bad.end(), [](const Fault& it) { return it.found; });
      if (first != bad.end()) {
        const auto face = static_cast<int>(first - bad.begin());
        return unusable(fmt::format(
            "the pinned vertices leave the piece between the vertices of rows {} and {}, columns {} and {} no "
            "room to be cut: pin them farther apart",
            face / size_.columns, face / size_.columns + 1, face % size_.columns, face % size_.columns + 1));
      }
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

  // The same of straight lines across cells.
  cv::Mat borders(const std::vector<PartitionEdge>& cuts) const {
    cv::Mat out(raster_, CV_8UC1, cv::Scalar(0));
    const auto place = [&](const Point<ArtworkFrame>& p) {
      return PlanePoint{p.x.count() * px_per_mm_, (height_ - p.y).count() * px_per_mm_};
    };
    for (const PartitionEdge& cut : cuts) {
      PlanePoint from = place(cut.curve.front()), to = place(cut.curve.back());
      const bool steep = std::abs(to.y - from.y) > std::abs(to.x - from.x);
      if (steep) std::swap(from.x, from.y), std::swap(to.x, to.y);
      if (from.x > to.x) std::swap(from, to);
      for (int i = static_cast<int>(std::ceil(from.x - 0.5)); i + 0.5 <= to.x; ++i) {
        const double at = from.y + (to.y - from.y) * (i + 0.5 - from.x) / (to.x - from.x);
        for (const int near : {-1, 0, 1}) {
          const cv::Point pixel(i, static_cast<int>(std::floor(at)) + near);
          const cv::Point in = steep ? cv::Point(pixel.y, pixel.x) : pixel;
          if (std::abs(pixel.y + 0.5 - at) <= 1 && cv::Rect({0, 0}, raster_).contains(in))
            out.at<std::uint8_t>(in) = 255;
        }
      }
    }
    return out;
  }

  // Which share of the edges' pixels lies on these borders; 0 without any edge.
  static double share_on(const EdgeImage& edges, const cv::Mat& borders) {
    const cv::Mat all = edges.upright | edges.level;
    const double count = cv::countNonZero(all);
    return count > 0 ? cv::countNonZero(all & borders) / count : 0;
  }

  MorphFigures figures(const MorphedGrid& made, const EdgeImage& edges) const {
    MorphFigures out;
    out.edges_before = share_on(edges, borders(straight_));
    out.edges_after = share_on(edges, borders(made.lines));
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
  std::vector<PlanePin> pins_;
  CutLines straight_, base_;  // base_: with the pinned vertices where they belong, else straight
};

}  // namespace

Result<MorphedGrid> morphed_grid(const cv::Mat& bgr, const cv::Mat& tones, Millimetres width, const PixelGrid& grid,
                                 const MorphOptions& options, const std::stop_token& stop) {
  return Morph(bgr, tones, width, grid, options, kCellPixels * options.fineness).run(stop);
}

Result<GridPreview> coarse_grid(const cv::Mat& bgr, Millimetres width, Millimetres height, const MorphOptions& options,
                                const std::stop_token& stop) {
  const PixelGrid unused{{1}, height};
  return Morph(bgr, {}, width, unused, options, kCoarseCellPixels).coarse(stop);
}

}  // namespace veneer::planner
