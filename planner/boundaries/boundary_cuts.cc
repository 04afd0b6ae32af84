#include "planner/boundaries/boundary_cuts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planner/boundaries/draw_back.h"
#include "planner/cancelled.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kCutRounds = 2;  // of columns and rows: "two repetitions to be sufficient"
// Borders are drawn back where something is wrong, then around whole faces, then to where they were.
constexpr int kStayWholeAfter = 9, kDrawingsBack = 16;

}  // namespace

BoundaryCuts::BoundaryCuts(const Problem& problem, const std::vector<MatchPanel>& panels,
                           const BoundaryOptions& options)
    : Borders(problem, panels, options) {
  double smallest = 1e9;
  for (const Box<ArtworkFrame>& cell : cells_)
    smallest = std::min({smallest, cell.width().count(), cell.height().count()});
  reach_ = px(options.overlap.count() > 0 ? options.overlap : Millimetres(smallest) * kReachShare);
  std::vector<CutLines> lines;
  for (std::size_t a = 0; a < members_.size(); ++a) {
    const WorkingArtwork& work = problem.artworks[a];
    if (work.lines) {
      lines.push_back(*work.lines);
      lines.back().faces.clear();
      for (const std::size_t i : members_[a]) lines.back().faces.push_back(work.lines->faces[problem.queue[i].patch]);
      continue;
    }
    std::vector<PixelRectangle> rectangles;
    for (const std::size_t i : members_[a]) {
      const Box<ArtworkFrame>& cell = cells_[i];
      rectangles.push_back(
          {px(cell.min.x), px(work.grid.height - cell.max.y), px(cell.max.x), px(work.grid.height - cell.min.y)});
    }
    lines.push_back(cut_lines(rectangles, px(width_of(a)), px(work.grid.height), work.features.size(), reach_));
  }
  now_ = drawn(std::move(lines));
}

Millimetres BoundaryCuts::width_of(std::size_t artwork) const {
  Millimetres width{0};
  for (const std::size_t i : members_[artwork]) width = std::max(width, cells_[i].max.x);
  return width;
}

CutOptions BoundaryCuts::cut_options() const { return {reach_, gap(), px(options_.limits.limits.width / 2), 0}; }

Borders::State BoundaryCuts::drawn(std::vector<CutLines> lines) const {
  State out;
  out.lines = std::move(lines);
  for (std::size_t a = 0; a < members_.size(); ++a)
    out.layouts.push_back(curved_layout(out.lines[a], width_of(a), problem_.artworks[a].grid, options_.smoothness));
  add_outlines(out);
  return out;
}

BoundaryCuts::Proposal BoundaryCuts::proposal(const std::vector<FaceCost>& costs) {
  std::vector<CutLines> cut = now_.lines;
  std::vector<std::vector<FaceCost>> own(members_.size());
  for (std::size_t a = 0; a < members_.size(); ++a) {
    for (const std::size_t i : members_[a]) own[a].push_back(costs[i]);
    reroute_all(cut[a], own[a], cut_options(), kCutRounds);
  }
  const double stride = std::max(3.0, px(kBorderStride));
  const double unit = stride * reach_ * 2 * mean_cost(costs);
  struct Smoothed {
    std::vector<CutLines> lines;
    CurveLength curves;
    double bend;
    bool is_smooth() const { return curves.long_enough(); }
  };
  Proposal out{cut, {}};
  out.smooth = smoothed_enough(
                   [&](double bend) {
                     Smoothed it{cut, {}, bend};
                     std::vector<CurveLength> lengths(cut.size());
                     (void)run_parallel(cut.size(), options_.threads, {}, [&](std::size_t a) {
                       smooth_all(it.lines[a], own[a], cut_options(), stride, bend * unit, kCutRounds);
                       lengths[a] = curve_length(
                           curved_layout(it.lines[a], width_of(a), problem_.artworks[a].grid, options_.smoothness));
                     });
                     for (const CurveLength& length : lengths) it.curves += length;
                     return it;
                   },
                   bend_)
                   .lines;
  return out;
}

RefineReport::PixelCut BoundaryCuts::beside(const std::vector<CutLines>& lines,
                                            const std::vector<CutLines>& by_pixels) const {
  double sum = 0, most = 0, count = 0;
  for (std::size_t a = 0; a < lines.size(); ++a)
    for (std::size_t l = 0; l < lines[a].lines.size(); ++l) {
      const CutLine& line = lines[a].lines[l];
      for (double along = std::ceil(line.begin) + 0.5; along < line.end; along += 1) {
        const double aside = std::abs(line(along) - by_pixels[a].lines[l](along));
        sum += aside, most = std::max(most, aside), count += 1;
      }
    }
  const ScanResolution& resolution = problem_.artworks.front().grid.resolution;
  return {resolution.to_mm(Pixels(count > 0 ? sum / count : 0)), resolution.to_mm(Pixels(most))};
}

Status BoundaryCuts::cut(const PatchPlacements& placements, const std::stop_token& stop) {
  const auto costs = costs_around(placements, stop);
  if (!costs.ok()) return costs.error();
  const Proposal proposed = proposal(*costs);
  const std::vector<CutLines>& wanted = proposed.smooth;
  std::vector<Shares> shares;
  shares.reserve(wanted.size());
  for (const CutLines& lines : wanted) shares.push_back(whole_way(lines));
  PieceFaults faults(panels_, placements, options_.limits, options_.threads);
  for (int back = 0;; ++back) {
    if (stop.stop_requested()) return cancelled();
    std::vector<CutLines> lines;
    for (std::size_t a = 0; a < wanted.size(); ++a) lines.push_back(between(now_.lines[a], wanted[a], shares[a]));
    State next = drawn(std::move(lines));
    const std::vector<PieceFaults::Fault> bad = faults.of(next.outlines);
    // A piece that is where it was is as sound as it was.
    const auto is_left = [&](std::size_t i) { return bad[i].found && next.outlines[i] != now_.outlines[i]; };
    bool sound = true;
    for (std::size_t i = 0; i < bad.size() && sound; ++i) sound = !is_left(i);
    if (sound) {
      next.pixel_cut = beside(next.lines, proposed.by_pixels);
      now_ = std::move(next);
      return Ok();
    }
    if (back == kDrawingsBack) return Ok();
    for (std::size_t a = 0; a < members_.size(); ++a) {
      const Shares before = shares[a];
      for (std::size_t f = 0; f < members_[a].size(); ++f) {
        const PieceFaults::Fault& fault = bad[members_[a][f]];
        if (!fault.found) continue;
        const bool all = fault.everywhere || back >= kWholeFacesAfter;
        if (all) draw_back(wanted[a], f, back >= kStayAfter ? 0 : kDrawBack, shares[a]);
        // What is to stay lies where its lines were, which may be elsewhere along them.
        if (all && back >= kStayWholeAfter) draw_back(now_.lines[a], f, 0, shares[a]);
        for (const Point<ArtworkFrame>& p : fault.places)
          if (!all) draw_back_near(wanted[a], f, px_of(a, p), px(kDrawBackNear), kDrawBack, before, shares[a]);
      }
    }
  }
}

}  // namespace veneer::planner
