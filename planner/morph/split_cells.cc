#include "planner/morph/split_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "base/polygon_ops.h"
#include "planner/layout/bezier_fit.h"
#include "planner/matching/patch_pixels.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr double kVarianceLeft = 0.4;  // of the whole cell's, at most, in the halves
constexpr double kToneStep = 0.06;     // between the halves' tones, at least
constexpr double kAlongEdge = 0.6;     // share of the cut that has an edge beside it, at least
constexpr double kBeside = 2;          // pixels
constexpr double kSharpest = 0.72;     // radians, 41 degrees: between a cut and a side, at least
// A cut is a cubic whose controls stand a third along the diagonal, aside by these steps of its length.
constexpr int kAsideSteps = 3;
constexpr double kAsideStep = 0.05;
constexpr std::size_t kTries = 12;  // cuts that are asked whether they can be made, the best first
constexpr std::size_t kSplitSamples = 24;

// One face of the grid and its ways to be cut.
class Cell {
 public:
  Cell(const Partition& cells, std::size_t face, const cv::Mat& tones, const cv::Mat& edges, const PixelGrid& grid,
       const SplitLimits& limits)
      : cells_(cells), boundary_(cells.faces[face].boundary), edges_(edges), grid_(grid), limits_(limits) {
    for (std::size_t k = 0; k < boundary_.size(); ++k) corners_.push_back(start_of(boundary_[k]));
    const PatchPixels own = patch_pixels(outline_of(cells, face), grid, tones.cols, tones.rows);
    for (const PatchPixels::Span& span : own.spans)
      for (int c = span.begin; c < span.end; ++c) {
        const double tone = static_cast<double>(tones.at<float>(span.row, c));
        pixels_.push_back({c + 0.5, span.row + 0.5, tone});
        sum_ += tone, squares_ += tone * tone;
      }
  }

  struct Cut {
    std::size_t from = 0;  // the diagonal goes from this corner to the one after the next
    PartitionEdge edge;
    double left = 0;  // squared deviations from the halves' tones
    std::array<double, 2> tones{};
  };
  // None: the cell stays whole.
  std::optional<Cut> best() const {
    if (boundary_.size() != 4 || pixels_.size() < 16) return std::nullopt;
    const auto count = static_cast<double>(pixels_.size());
    const double whole = squares_ - sum_ * sum_ / count;
    if (whole < count * kToneStep * kToneStep / 4) return std::nullopt;
    std::vector<Cut> cuts;
    for (const std::size_t from : {0, 1})
      for (int first = -kAsideSteps; first <= kAsideSteps; ++first)
        for (int second = -kAsideSteps; second <= kAsideSteps; ++second)
          if (const auto cut = along(from, first * kAsideStep, second * kAsideStep);
              cut && cut->left <= whole * kVarianceLeft && is_blunt(*cut))
            cuts.push_back(*cut);
    std::stable_sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) { return a.left < b.left; });
    for (std::size_t i = 0; i < std::min(cuts.size(), kTries); ++i)
      if (has_edge(cuts[i].edge) && can_be_made(cuts[i])) return cuts[i];
    return std::nullopt;
  }

  // The boundaries of both halves; the cut is edge `number` of the partition, forwards in the first of them.
  std::array<std::vector<DirectedEdge>, 2> halves(std::size_t from, std::size_t number) const {
    const auto side = [&](std::size_t k) { return boundary_[(from + k) % 4]; };
    // From the far corner on two sides lead back to where the cut begins.
    return {std::vector<DirectedEdge>{{number, false}, side(2), side(3)},
            std::vector<DirectedEdge>{{number, true}, side(0), side(1)}};
  }

 private:
  struct TonePixel {
    double x, y, tone;
  };

  Point<ArtworkFrame> start_of(const DirectedEdge& it) const {
    const PartitionEdge& edge = cells_.edges[it.edge];
    return it.backwards ? edge.curve.back() : edge.curve.front();
  }
  PlanePoint px_of(const Point<ArtworkFrame>& p) const {
    return {grid_.resolution.to_px(p.x).count(), grid_.resolution.to_px(grid_.height - p.y).count()};
  }

  // With its controls so far aside, in lengths of the diagonal. None: a half would have no pixels, or the tones of both
  // are alike.
  std::optional<Cut> along(std::size_t from, double first, double second) const {
    const PlanePoint a = px_of(corners_[from]), c = px_of(corners_[from + 2]);
    const double dx = c.x - a.x, dy = c.y - a.y, square = dx * dx + dy * dy;
    double sum = 0, squares = 0, count = 0;
    for (const TonePixel& it : pixels_) {
      // How far along the diagonal and aside of it. A third and two thirds along, controls make the parameter of the
      // curve the place along it.
      const double u = ((it.x - a.x) * dx + (it.y - a.y) * dy) / square;
      const double v = ((it.y - a.y) * dx - (it.x - a.x) * dy) / square;
      if (v < 3 * u * (1 - u) * ((1 - u) * first + u * second)) continue;
      sum += it.tone, squares += it.tone * it.tone, count += 1;
    }
    const double others = static_cast<double>(pixels_.size()) - count;
    if (count < 1 || others < 1 || std::abs(sum / count - (sum_ - sum) / others) < kToneStep) return std::nullopt;
    Cut out{from, straight_edge(corners_[from], corners_[from + 2]), 0, {sum / count, (sum_ - sum) / others}};
    out.left = squares - sum * sum / count + squares_ - squares - (sum_ - sum) * (sum_ - sum) / others;
    const auto whole = [](Millimetres length) {
      return Millimetres(static_cast<double>(std::llround(length.count() * 1000)) / 1000);
    };
    const Millimetres x = corners_[from + 2].x - corners_[from].x, y = corners_[from + 2].y - corners_[from].y;
    const std::array aside{first, second};
    for (std::size_t k = 0; k < 2; ++k) {
      // Pixels have y down, so that what lies aside of them to the right is so in the artwork's frame to the left.
      Point<ArtworkFrame>& control = out.edge.curve[k + 1];
      control = {whole(control.x + y * aside[k]), whole(control.y - x * aside[k])};
    }
    return out;
  }

  // Whether the cut leaves no half a corner that is clearly too sharp; can_be_made() says it exactly, and takes longer.
  bool is_blunt(const Cut& cut) const {
    const Polyline<ArtworkFrame> way = flattened(cut.edge);
    const Polyline<ArtworkFrame> back(way.rbegin(), way.rend());
    for (const bool far : {false, true}) {
      const std::size_t corner = (cut.from + (far ? 2 : 0)) % 4;
      const double along = direction(far ? back : way);
      for (const bool next : {false, true}) {
        const DirectedEdge& side = boundary_[next ? corner : (corner + 3) % 4];
        Polyline<ArtworkFrame> path = flattened(cells_.edges[side.edge]);
        if (side.backwards == next) std::reverse(path.begin(), path.end());
        if (std::abs(std::remainder(direction(path) - along, 2 * std::numbers::pi)) < kSharpest) return false;
      }
    }
    return true;
  }
  // In which a path sets out, looked at over as much of it as a corner's tip is long.
  double direction(const Polyline<ArtworkFrame>& path) const {
    std::size_t i = 1;
    while (i + 1 < path.size() && distance(path[0], path[i]) < limits_.limits.width) ++i;
    return std::atan2((path[i].y - path[0].y).count(), (path[i].x - path[0].x).count());
  }

  bool has_edge(const PartitionEdge& cut) const {
    const Cubic cubic{px_of(cut.curve[0]), px_of(cut.curve[1]), px_of(cut.curve[2]), px_of(cut.curve[3])};
    std::size_t beside = 0;
    for (std::size_t k = 0; k < kSplitSamples; ++k)
      beside += edge_near(at(cubic, (static_cast<double>(k) + 0.5) / kSplitSamples)) ? 1 : 0;
    return static_cast<double>(beside) >= kAlongEdge * kSplitSamples;
  }
  bool edge_near(const PlanePoint& p) const {
    for (int r = static_cast<int>(std::floor(p.y - kBeside)); r <= static_cast<int>(std::floor(p.y + kBeside)); ++r)
      for (int c = static_cast<int>(std::floor(p.x - kBeside)); c <= static_cast<int>(std::floor(p.x + kBeside)); ++c)
        if (r >= 0 && c >= 0 && r < edges_.rows && c < edges_.cols && edges_.at<std::uint8_t>(r, c) != 0 &&
            std::hypot(c + 0.5 - p.x, r + 0.5 - p.y) <= kBeside)
          return true;
    return false;
  }

  bool can_be_made(const Cut& cut) const {
    Partition both{cells_.width, cells_.height, {}, {}};
    for (const DirectedEdge& it : boundary_) both.edges.push_back(cells_.edges[it.edge]);
    both.edges.push_back(cut.edge);
    for (std::vector<DirectedEdge>& half : halves(cut.from, cells_.edges.size())) {
      for (DirectedEdge& it : half) {
        const auto known = std::find_if(boundary_.begin(), boundary_.end(),
                                        [&](const DirectedEdge& side) { return side.edge == it.edge; });
        it.edge = static_cast<std::size_t>(known - boundary_.begin());
      }
      both.faces.push_back({std::move(half)});
    }
    for (const std::size_t half : {0, 1}) {
      const Ring<ArtworkFrame> outline = outline_of(both, half);
      if (fault_of(outline, limits_.limits)) return false;
      if (offset(Region<ArtworkFrame>(outline), limits_.size / -2.0, Corners::kRound).empty()) return false;
    }
    return true;
  }

  const Partition& cells_;
  const std::vector<DirectedEdge>& boundary_;
  const cv::Mat& edges_;
  const PixelGrid& grid_;
  const SplitLimits& limits_;
  std::vector<Point<ArtworkFrame>> corners_;
  std::vector<TonePixel> pixels_;
  double sum_ = 0, squares_ = 0;
};

double middle_height(const Partition& partition, const std::vector<DirectedEdge>& boundary) {
  double sum = 0;
  for (const DirectedEdge& it : boundary) {
    const PartitionEdge& edge = partition.edges[it.edge];
    sum += (it.backwards ? edge.curve.back() : edge.curve.front()).y.count();
  }
  return sum / static_cast<double>(boundary.size());
}

}  // namespace

SplitCells split_cells(const Partition& cells, const cv::Mat& tones, const cv::Mat& edges, const PixelGrid& grid,
                       const SplitLimits& limits) {
  std::vector<std::optional<Cell::Cut>> cuts(cells.faces.size());
  (void)run_parallel(cuts.size(), limits.threads, {},
                     [&](std::size_t f) { cuts[f] = Cell(cells, f, tones, edges, grid, limits).best(); });
  Partition cut{cells.width, cells.height, cells.edges, {}};
  SplitCells out;
  out.tones.resize(cuts.size());
  for (std::size_t f = 0; f < cuts.size(); ++f) {
    if (!cuts[f]) {
      cut.faces.push_back(cells.faces[f]);
      continue;
    }
    ++out.count, out.tones[f] = cuts[f]->tones;
    cut.edges.push_back(cuts[f]->edge);
    out.cuts.push_back(cuts[f]->edge);
    auto halves = Cell(cells, f, tones, edges, grid, limits).halves(cuts[f]->from, cut.edges.size() - 1);
    if (middle_height(cut, halves[1]) > middle_height(cut, halves[0])) std::swap(halves[0], halves[1]);
    for (std::vector<DirectedEdge>& half : halves) cut.faces.push_back({std::move(half)});
  }
  std::vector<std::size_t> order(cut.faces.size());
  for (std::size_t f = 0; f < order.size(); ++f) order[f] = f;
  out.partition = with_faces(cut, order);
  return out;
}

}  // namespace veneer::planner
