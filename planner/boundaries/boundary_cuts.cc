#include "planner/boundaries/boundary_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "planner/boundaries/draw_back.h"
#include "planner/cancelled.h"
#include "planner/parallel.h"
#include "planner/poses/admission.h"

namespace veneer::planner {
namespace {

constexpr double kReachShare = 0.375;     // of the smallest patch's side
constexpr double kGap = 1.25;             // of the least width: what lines that run aslant need straight across
constexpr int kCutRounds = 2;             // of columns and rows: "two repetitions to be sufficient"
constexpr Millimetres kCurveError{0.06};  // fitted curves lie this far beside the pixels that were chosen
// What rounding to whole micrometres may take of FreeWood::kSlack.
constexpr Millimetres kRounding{0.001};
// Borders are drawn back by this factor where something is wrong, then around whole faces, then to where they were.
constexpr double kDrawBack = 0.5;
constexpr Millimetres kNear{1};
constexpr int kWholeFacesAfter = 4, kStayAfter = 6, kStayWholeAfter = 9, kDrawingsBack = 16;
constexpr Millimetres kStride{0.5};  // between the controls of smooth lines
// What a turn of a smooth line costs, in mean costs of a stride as wide as the whole overlap, until curves are long
// enough.
constexpr std::array kBends = {0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064};

// Over the pixels that the faces may have.
double mean_cost(const std::vector<FaceCost>& costs) {
  double sum = 0, count = 0;
  for (const FaceCost& face : costs)
    for (int r = 0; r < face.cost.rows; ++r)
      for (int c = 0; c < face.cost.cols; ++c) {
        const float cost = face.cost.at<float>(r, c);
        if (cost > 0 && cost < kForbidden) sum += static_cast<double>(cost), count += 1;
      }
  return count > 0 ? sum / count : 0;
}

}  // namespace

BoundaryCuts::BoundaryCuts(const Problem& problem, const std::vector<MatchPanel>& panels,
                           const BoundaryOptions& options)
    : problem_(problem), options_(options), members_(problem.artworks.size()) {
  for (const MatchPanel& panel : panels)
    panels_.push_back({panel.features, FreeWood(panel.wood.raster(), panel.wood.kerf() - kRounding,
                                                panel.wood.border() - panel.wood.kerf() - FreeWood::kSlack)});
  double smallest = 1e9;
  for (std::size_t i = 0; i < problem.queue.size(); ++i) {
    members_[problem.queue[i].artwork].push_back(i);
    cells_.push_back(bounds(problem.queue[i].match.outline));
    smallest = std::min({smallest, cells_.back().width().count(), cells_.back().height().count()});
  }
  const ScanResolution resolution = problem.artworks.front().grid.resolution;
  const Millimetres overlap = options.overlap.count() > 0 ? options.overlap : Millimetres(smallest) * kReachShare;
  reach_ = resolution.to_px(overlap).count();
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
      const auto px = [&](Millimetres length) { return resolution.to_px(length).count(); };
      rectangles.push_back(
          {px(cell.min.x), px(work.grid.height - cell.max.y), px(cell.max.x), px(work.grid.height - cell.min.y)});
    }
    lines.push_back(cut_lines(rectangles, resolution.to_px(width_of(a)).count(),
                              resolution.to_px(work.grid.height).count(), work.features.size(), reach_));
  }
  now_ = drawn(std::move(lines));
}

Millimetres BoundaryCuts::width_of(std::size_t artwork) const {
  Millimetres width{0};
  for (const std::size_t i : members_[artwork]) width = std::max(width, cells_[i].max.x);
  return width;
}

PlanePoint BoundaryCuts::px_of(std::size_t artwork, const Point<ArtworkFrame>& p) const {
  const PixelGrid& grid = problem_.artworks[artwork].grid;
  return {grid.resolution.to_px(p.x).count(), grid.resolution.to_px(grid.height - p.y).count()};
}

CutOptions BoundaryCuts::cut_options() const {
  const ScanResolution resolution = problem_.artworks.front().grid.resolution;
  return {reach_, resolution.to_px(options_.limits.width * kGap).count(),
          resolution.to_px(options_.limits.width / 2).count(), 0};
}

cv::Rect BoundaryCuts::window_of(std::size_t task) const {
  const WorkingArtwork& work = problem_.artworks[problem_.queue[task].artwork];
  const Box<ArtworkFrame>& cell = cells_[task];
  const auto px = [&](Millimetres length) { return work.grid.resolution.to_px(length).count(); };
  const cv::Point first(static_cast<int>(std::floor(px(cell.min.x) - reach_)) - 1,
                        static_cast<int>(std::floor(px(work.grid.height - cell.max.y) - reach_)) - 1);
  const cv::Point last(static_cast<int>(std::ceil(px(cell.max.x) + reach_)) + 1,
                       static_cast<int>(std::ceil(px(work.grid.height - cell.min.y) + reach_)) + 1);
  return cv::Rect(first, last) & cv::Rect({0, 0}, work.features.size());
}

BoundaryCuts::State BoundaryCuts::drawn(std::vector<CutLines> lines) const {
  State out{std::move(lines),
            std::vector<Partition>(members_.size()),
            std::vector<Ring<ArtworkFrame>>(problem_.queue.size()),
            {}};
  for (std::size_t a = 0; a < members_.size(); ++a) {
    out.layouts[a] = curved_layout(out.lines[a], width_of(a), problem_.artworks[a].grid, options_.smoothness);
    for (std::size_t f = 0; f < members_[a].size(); ++f) out.outlines[members_[a][f]] = outline_of(out.layouts[a], f);
    out.curves += curve_length(out.layouts[a]);
  }
  return out;
}

std::vector<CutLines> BoundaryCuts::proposal(const std::vector<FaceCost>& costs) const {
  std::vector<CutLines> cut = now_.lines;
  std::vector<std::vector<FaceCost>> own(members_.size());
  for (std::size_t a = 0; a < members_.size(); ++a) {
    for (const std::size_t i : members_[a]) own[a].push_back(costs[i]);
    recut_all(cut[a], own[a], cut_options(), kCutRounds);
  }
  const double stride = std::max(3.0, problem_.artworks.front().grid.resolution.to_px(kStride).count());
  const double unit = stride * reach_ * 2 * mean_cost(costs);
  struct Smoothed {
    std::vector<CutLines> lines;
    CurveLength curves;
  };
  const auto smoothed = [&](double bend) {
    Smoothed out{cut, {}};
    std::vector<CurveLength> lengths(cut.size());
    (void)run_parallel(cut.size(), options_.threads, {}, [&](std::size_t a) {
      smooth_all(out.lines[a], own[a], cut_options(), stride, bend * unit, kCutRounds);
      lengths[a] =
          curve_length(curved_layout(out.lines[a], width_of(a), problem_.artworks[a].grid, options_.smoothness));
    });
    for (const CurveLength& length : lengths) out.curves += length;
    return out;
  };
  // As little smoothing as gives curves of the wanted length; the smoother, the longer they are.
  std::size_t too_little = 0, enough = kBends.size() - 1;
  std::vector<CutLines> out;  // of `enough`, when that was looked at
  while (too_little < enough) {
    const std::size_t middle = (too_little + enough) / 2;
    Smoothed it = smoothed(kBends[middle]);
    if (it.curves.long_enough())
      enough = middle, out = std::move(it.lines);
    else
      too_little = middle + 1;
  }
  return out.empty() ? smoothed(kBends[enough]).lines : out;
}

// Points of an outline that lie nearer than `border` to a pixel that is not free.
std::vector<Point<PanelFrame>> near_blocked(const Ring<PanelFrame>& outline, const Raster<PanelFrame>& free,
                                            Millimetres border) {
  const double reach = free.resolution.to_px(border).count();
  const auto is_near = [&](const Point<PanelFrame>& p) {
    double x = 0, y = 0;
    free.to_pixels(p, x, y);
    for (int r = static_cast<int>(std::floor(y - reach)); r <= static_cast<int>(std::floor(y + reach)); ++r)
      for (int c = static_cast<int>(std::floor(x - reach)); c <= static_cast<int>(std::floor(x + reach)); ++c) {
        const double dx = std::max({c - x, x - c - 1, 0.0}), dy = std::max({r - y, y - r - 1, 0.0});
        if (std::max(dx, dy) > reach) continue;
        if (r < 0 || c < 0 || r >= free.pixels.rows || c >= free.pixels.cols || free.pixels.at<std::uint8_t>(r, c) == 0)
          return true;
      }
    return false;
  };
  std::vector<Point<PanelFrame>> out;
  constexpr double kStep = 0.2;  // mm
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const int steps = std::max(1, static_cast<int>(distance(a, b).count() / kStep));
    for (int k = 0; k < steps; ++k) {
      const Point<PanelFrame> p{a.x + (b.x - a.x) * (static_cast<double>(k) / steps),
                                a.y + (b.y - a.y) * (static_cast<double>(k) / steps)};
      if (is_near(p)) out.push_back(p);
    }
  }
  return out;
}

// Faces at one set of placements, looked at again and again while some of them change: what did not is not looked at
// anew.
struct BoundaryCuts::Looked {
  std::vector<Ring<ArtworkFrame>> outlines;  // as they were looked at
  std::vector<Fault> own;                    // what is wrong with a piece by itself
  std::vector<Region<PanelFrame>> grown;     // by the kerf, where it lies
  std::vector<Box<PanelFrame>> boxes;
  std::map<std::pair<std::size_t, std::size_t>, Region<PanelFrame>> shared;  // by two pieces that lie near each other
};

std::vector<BoundaryCuts::Fault> BoundaryCuts::faults(const State& state, const PatchPlacements& placements,
                                                      Looked& looked) const {
  const std::size_t count = problem_.queue.size();
  const bool first = looked.outlines.empty();
  looked.own.resize(count), looked.grown.resize(count), looked.boxes.resize(count);
  std::vector<char> changed(count, 1);
  for (std::size_t i = 0; i < count && !first; ++i) changed[i] = looked.outlines[i] != state.outlines[i] ? 1 : 0;
  looked.outlines = state.outlines;
  std::vector<Region<PanelFrame>>& grown = looked.grown;
  std::vector<Box<PanelFrame>>& boxes = looked.boxes;
  (void)run_parallel(count, options_.threads, {}, [&](std::size_t i) {
    if (changed[i] == 0) return;
    Fault& fault = looked.own[i] = {};
    boxes[i] = {};
    if (const auto shape = fault_of(state.outlines[i], options_.limits, &fault.places)) {
      fault.found = true, fault.everywhere = *shape != FabricationFault::kThin || fault.places.empty();
    }
    if (!placements[i]) return;
    const auto& map = placements[i]->panel_from_artwork;
    const Ring<PanelFrame> there = map * state.outlines[i];
    const FreeWood& wood = panels_[static_cast<std::size_t>(placements[i]->panel)].wood;
    if (!wood.on_free_wood(there)) {
      const std::vector<Point<PanelFrame>> near = near_blocked(there, wood.raster(), wood.border());
      for (const Point<PanelFrame>& p : near) fault.places.push_back(map.inverse() * p);
      fault.found = true, fault.everywhere = fault.everywhere || near.empty();
    }
    grown[i] = offset(Region<PanelFrame>(there), wood.kerf() + (FreeWood::kSlack + kRounding) / 2);
    for (const auto& ring : grown[i].rings()) {
      for (const auto& p : ring) boxes[i].add(p);
      if (signed_area(ring) > 0) continue;
      // A bay whose mouth the kerf closes: the wood in it would fall out with the piece.
      for (const auto& p : ring) fault.places.push_back(map.inverse() * p);
      fault.found = true;
    }
  });
  std::vector<Fault> out = looked.own;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; placements[i] && j < i; ++j) {
      if (!placements[j] || placements[i]->panel != placements[j]->panel) continue;
      if (boxes[i].min.x > boxes[j].max.x || boxes[j].min.x > boxes[i].max.x || boxes[i].min.y > boxes[j].max.y ||
          boxes[j].min.y > boxes[i].max.y)
        continue;
      const auto [there, fresh] = looked.shared.try_emplace({i, j});
      if (fresh || changed[i] != 0 || changed[j] != 0) there->second = intersect(grown[i], grown[j]);
      for (const auto& ring : there->second.rings())
        for (const std::size_t k : {i, j}) {
          const auto back = placements[k]->panel_from_artwork.inverse();
          for (const auto& p : ring) out[k].places.push_back(back * p);
          out[k].found = true;
        }
    }
  return out;
}

Result<PatchPlacements> BoundaryCuts::settled(const PatchPlacements& wished, const PatchPlacements& before,
                                              const std::stop_token& stop) const {
  const auto outlines = [&](const PatchPlacements& placements) {
    PlacedOutlines out(placements.size());
    for (std::size_t i = 0; i < out.size(); ++i)
      if (placements[i])
        out[i] = PlacedOutline{placements[i]->panel, placements[i]->panel_from_artwork * now_.outlines[i]};
    return out;
  };
  const Result<std::vector<bool>> moves = admitted(outlines(wished), outlines(before), panels_, stop);
  if (!moves.ok()) return moves.error();
  PatchPlacements out = before;
  for (std::size_t i = 0; i < out.size(); ++i)
    if ((*moves)[i]) out[i] = wished[i];
  return out;
}

Status BoundaryCuts::cut(const PatchPlacements& placements, const std::stop_token& stop) {
  std::vector<PlacedFace> placed;
  for (std::size_t i = 0; i < problem_.queue.size(); ++i)
    placed.push_back({&problem_.artworks[problem_.queue[i].artwork], now_.outlines[i], &placements[i], window_of(i)});
  const auto costs = wood_around(placed, panels_, kCurveError, options_.threads, stop);
  if (!costs.ok()) return costs.error();
  const std::vector<CutLines> wanted = proposal(*costs);
  std::vector<Shares> shares;
  shares.reserve(wanted.size());
  for (const CutLines& lines : wanted) shares.push_back(whole_way(lines));
  Looked looked;
  for (int back = 0;; ++back) {
    if (stop.stop_requested()) return cancelled();
    std::vector<CutLines> lines;
    for (std::size_t a = 0; a < wanted.size(); ++a) lines.push_back(between(now_.lines[a], wanted[a], shares[a]));
    State next = drawn(std::move(lines));
    const std::vector<Fault> bad = faults(next, placements, looked);
    // A piece that is where it was is as sound as it was.
    const auto is_left = [&](std::size_t i) { return bad[i].found && next.outlines[i] != now_.outlines[i]; };
    bool sound = true;
    for (std::size_t i = 0; i < bad.size() && sound; ++i) sound = !is_left(i);
    if (sound) {
      now_ = std::move(next);
      return Ok();
    }
    if (back == kDrawingsBack) return Ok();
    const double near = problem_.artworks.front().grid.resolution.to_px(kNear).count();
    for (std::size_t a = 0; a < members_.size(); ++a) {
      const Shares before = shares[a];
      for (std::size_t f = 0; f < members_[a].size(); ++f) {
        const Fault& fault = bad[members_[a][f]];
        if (!fault.found) continue;
        const bool all = fault.everywhere || back >= kWholeFacesAfter;
        if (all) draw_back(wanted[a], f, back >= kStayAfter ? 0 : kDrawBack, shares[a]);
        // What is to stay lies where its lines were, which may be elsewhere along them.
        if (all && back >= kStayWholeAfter) draw_back(now_.lines[a], f, 0, shares[a]);
        for (const Point<ArtworkFrame>& p : fault.places)
          if (!all) draw_back_near(wanted[a], f, px_of(a, p), near, kDrawBack, before, shares[a]);
      }
    }
  }
}

}  // namespace veneer::planner
