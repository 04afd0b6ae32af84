#include "planner/boundaries/edge_cuts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/boundaries/draw_back.h"
#include "planner/cancelled.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

bool is_inner(const PartitionEdge& edge) {
  return edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside;
}

cv::Rect2d box_of(const std::vector<PlanePoint>& path, double around) {
  double left = path[0].x, right = left, top = path[0].y, bottom = top;
  for (const PlanePoint& p : path)
    left = std::min(left, p.x), right = std::max(right, p.x), top = std::min(top, p.y), bottom = std::max(bottom, p.y);
  return {left - around, top - around, right - left + 2 * around, bottom - top + 2 * around};
}

// The same for every place of every strip.
std::vector<std::vector<double>> along(const std::vector<EdgeStrip>& strips, double value) {
  std::vector<std::vector<double>> out;
  out.reserve(strips.size());
  for (const EdgeStrip& strip : strips) out.emplace_back(strip.size(), value);
  return out;
}

}  // namespace

EdgeCuts::EdgeCuts(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options)
    : Borders(problem, panels, options), home_(problem.artworks.size()), edges_of_task_(problem.queue.size()) {
  double area = 0;
  for (std::size_t a = 0; a < members_.size(); ++a) {
    std::vector<std::size_t> order;
    for (const std::size_t i : members_[a]) order.push_back(problem.queue[i].patch);
    const Partition& layout = now_.layouts.emplace_back(with_faces(*problem.artworks[a].layout, order));
    area += (layout.width * layout.height).count();
    for (std::size_t e = 0; e < layout.edges.size(); ++e) {
      const PartitionEdge& edge = layout.edges[e];
      home_[a].push_back(path_of(a, edge));
      if (!is_inner(edge)) continue;
      for (const std::size_t face : {edge.left, edge.right}) edges_of_task_[members_[a][face]].push_back(inner_.size());
      inner_.push_back({a, e});
    }
  }
  const Millimetres side(std::sqrt(area / static_cast<double>(problem.queue.size())));
  reach_ = px(options.overlap.count() > 0 ? options.overlap : side * kReachShare);
  add_outlines(now_);
}

std::vector<PlanePoint> EdgeCuts::path_of(std::size_t artwork, const PartitionEdge& edge) const {
  std::vector<PlanePoint> out;
  for (const Point<ArtworkFrame>& p : flattened(edge)) out.push_back(px_of(artwork, p));
  return out;
}

Result<EdgeCuts::Strips> EdgeCuts::strips(const std::stop_token& stop) const {
  std::vector<std::vector<std::vector<PlanePoint>>> paths(home_.size());
  std::vector<std::vector<cv::Rect2d>> boxes(home_.size());
  for (std::size_t a = 0; a < home_.size(); ++a)
    for (const PartitionEdge& edge : now_.layouts[a].edges) {
      paths[a].push_back(path_of(a, edge));
      boxes[a].push_back(box_of(paths[a].back(), reach_ + gap() / 2));
    }
  std::vector<std::optional<EdgeStrip>> made(inner_.size());
  const Status done = run_parallel(made.size(), options_.threads, stop, [&](std::size_t i) {
    const auto& [a, e] = inner_[i];
    std::vector<std::vector<PlanePoint>> others;
    for (std::size_t k = 0; k < paths[a].size(); ++k)
      if (k != e && (boxes[a][k] & boxes[a][e]).area() > 0) others.push_back(paths[a][k]);
    made[i].emplace(paths[a][e], home_[a][e], others, reach_, gap());
  });
  if (!done.ok()) return done.error();
  Strips out;
  for (std::optional<EdgeStrip>& strip : made) out.push_back(*std::move(strip));
  return out;
}

PartitionEdge EdgeCuts::drawn(const Inner& inner, const EdgeStrip& strip, const std::vector<double>& offsets) const {
  const PartitionEdge& was = now_.layouts[inner.artwork].edges[inner.edge];
  if (std::all_of(offsets.begin(), offsets.end(), [](double aside) { return aside == 0; })) return was;
  const PixelGrid& grid = problem_.artworks[inner.artwork].grid;
  const auto plane = [](const Point<ArtworkFrame>& p) { return PlanePoint{p.x.count(), p.y.count()}; };
  std::vector<PlanePoint> path{plane(was.curve.front())};
  for (std::size_t i = 1; i + 1 < offsets.size(); ++i) {
    const PlanePoint p = strip.at(i, offsets[i]);
    const PlanePoint q{grid.resolution.to_mm(Pixels(p.x)).count(),
                       (grid.height - grid.resolution.to_mm(Pixels(p.y))).count()};
    constexpr double kAlike = 1e-3;  // mm
    if (std::hypot(q.x - path.back().x, q.y - path.back().y) > kAlike) path.push_back(q);
  }
  path.push_back(plane(was.curve.back()));
  PartitionEdge out{{was.curve.front()}, was.left, was.right};
  const auto whole = [](double mm) { return static_cast<double>(std::llround(mm * 1000)) / 1000; };
  // What rounding to micrometres moves a curve by is left to it.
  for (const Cubic& cubic : fit_cubics(path, kFitTolerance.count() - 0.001, options_.smoothness))
    for (std::size_t k = 1; k < 4; ++k) out.curve.push_back(point<ArtworkFrame>(whole(cubic[k].x), whole(cubic[k].y)));
  out.curve.back() = was.curve.back();
  return out;
}

Borders::State EdgeCuts::drawn(const Strips& strips, const Offsets& offsets, const Offsets& before,
                               const State& like) const {
  State out;
  out.layouts = like.layouts;
  (void)run_parallel(inner_.size(), options_.threads, {}, [&](std::size_t i) {
    if (before[i] != offsets[i])
      out.layouts[inner_[i].artwork].edges[inner_[i].edge] = drawn(inner_[i], strips[i], offsets[i]);
  });
  add_outlines(out);
  return out;
}

Result<EdgeCuts::Offsets> EdgeCuts::proposal(const Strips& strips, const std::vector<FaceCost>& costs,
                                             const std::stop_token& stop) const {
  std::vector<EdgeStrip::Costs> own(inner_.size());
  const Status measured = run_parallel(inner_.size(), options_.threads, stop, [&](std::size_t i) {
    const PartitionEdge& edge = now_.layouts[inner_[i].artwork].edges[inner_[i].edge];
    const std::vector<std::size_t>& tasks = members_[inner_[i].artwork];
    own[i] = strips[i].costs(costs[tasks[edge.left]], costs[tasks[edge.right]]);
  });
  if (!measured.ok()) return measured.error();
  const Offsets straight = along(strips, 0);
  const double stride = std::max(3.0, px(kBorderStride));
  const double unit = stride * reach_ * 2 * mean_cost(costs);
  // An edge has one curve at least, however short it is, and on the mean every fourth has one more.
  double most = 0;
  for (const EdgeStrip& strip : strips) most += 0.25 + std::max(1.0, strip.length() / px(kWantedSegment));
  struct Smoothed {
    Offsets offsets;
    double most;
    CurveLength curves;
    bool is_smooth() const { return static_cast<double>(curves.segments) <= most; }
  };
  Offsets out = smoothed_enough([&](double bend) {
                  Smoothed it{Offsets(inner_.size()), most, {}};
                  (void)run_parallel(inner_.size(), options_.threads, stop, [&](std::size_t i) {
                    it.offsets[i] = strips[i].cheapest(own[i], stride, bend * unit);
                  });
                  if (!stop.stop_requested()) it.curves = drawn(strips, it.offsets, straight, now_).curves;
                  return it;
                }).offsets;
  if (stop.stop_requested()) return cancelled();
  return out;
}

bool EdgeCuts::draw_back(const std::vector<PieceFaults::Fault>& bad, const Strips& strips, const State& next,
                         const Offsets& offsets, int times, Offsets& shares) const {
  const Offsets before = shares;
  bool found = false;
  for (std::size_t task = 0; task < bad.size(); ++task) {
    // A piece that is where it was is as sound as it was.
    if (!bad[task].found || next.outlines[task] == now_.outlines[task]) continue;
    found = true;
    const bool all = bad[task].everywhere || times >= kWholeFacesAfter;
    for (const std::size_t i : edges_of_task_[task]) {
      std::vector<double>& share = shares[i];
      for (std::size_t k = 0; all && k < share.size(); ++k)
        share[k] = times >= kStayAfter ? 0 : before[i][k] * kDrawBack;
      for (const Point<ArtworkFrame>& place : bad[task].places) {
        if (all) break;
        const PlanePoint p = px_of(problem_.queue[task].artwork, place);
        for (std::size_t k = 0; k < share.size(); ++k) {
          const PlanePoint q = strips[i].at(k, offsets[i][k]);
          if (std::hypot(p.x - q.x, p.y - q.y) <= px(kDrawBackNear)) share[k] = before[i][k] * kDrawBack;
        }
      }
    }
  }
  return found;
}

Status EdgeCuts::cut(const PatchPlacements& placements, const std::stop_token& stop) {
  const auto costs = costs_around(placements, stop);
  if (!costs.ok()) return costs.error();
  const Result<Strips> around = strips(stop);
  if (!around.ok()) return around.error();
  const Result<Offsets> wanted = proposal(*around, *costs, stop);
  if (!wanted.ok()) return wanted.error();
  PieceFaults faults(panels_, placements, options_.limits, options_.threads);
  const Offsets straight = along(*around, 0);
  Offsets shares = along(*around, 1), before = straight;
  State next = now_;
  // Each time at least one more edge stays, at last.
  for (int times = 0;; ++times) {
    if (stop.stop_requested()) return cancelled();
    Offsets offsets;
    for (std::size_t i = 0; i < inner_.size(); ++i) offsets.push_back(between(straight[i], (*wanted)[i], shares[i]));
    next = drawn(*around, offsets, before, next);
    if (!draw_back(faults.of(next.outlines), *around, next, offsets, times, shares)) break;
    before = std::move(offsets);
  }
  now_ = std::move(next);
  return Ok();
}

}  // namespace veneer::planner
