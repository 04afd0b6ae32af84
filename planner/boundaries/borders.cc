#include "planner/boundaries/borders.h"

#include <algorithm>
#include <cmath>

#include "planner/boundaries/boundary_cuts.h"
#include "planner/boundaries/edge_cuts.h"
#include "planner/poses/admission.h"

namespace veneer::planner {
namespace {

constexpr double kGapShare = 1.25;        // of the least width: what lines that run aslant need straight across
constexpr Millimetres kCurveError{0.06};  // fitted curves lie this far beside the pixels that were chosen

}  // namespace

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

Borders::Borders(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options)
    : problem_(problem), options_(options), members_(problem.artworks.size()) {
  for (const MatchPanel& panel : panels)
    panels_.push_back({panel.features, FreeWood(panel.wood.raster(), panel.wood.kerf() - kBorderRounding,
                                                panel.wood.border() - panel.wood.kerf() - FreeWood::kSlack)});
  for (std::size_t i = 0; i < problem.queue.size(); ++i) {
    members_[problem.queue[i].artwork].push_back(i);
    cells_.push_back(bounds(problem.queue[i].match.outline));
  }
}

double Borders::px(Millimetres length) const { return problem_.artworks.front().grid.resolution.to_px(length).count(); }

PlanePoint Borders::px_of(std::size_t artwork, const Point<ArtworkFrame>& p) const {
  return {px(p.x), px(problem_.artworks[artwork].grid.height - p.y)};
}

double Borders::gap() const { return px(options_.limits.limits.width * kGapShare); }

cv::Rect Borders::window_of(std::size_t task) const {
  const WorkingArtwork& work = problem_.artworks[problem_.queue[task].artwork];
  const Box<ArtworkFrame>& cell = cells_[task];
  const cv::Point first(static_cast<int>(std::floor(px(cell.min.x) - reach_)) - 1,
                        static_cast<int>(std::floor(px(work.grid.height - cell.max.y) - reach_)) - 1);
  const cv::Point last(static_cast<int>(std::ceil(px(cell.max.x) + reach_)) + 1,
                       static_cast<int>(std::ceil(px(work.grid.height - cell.min.y) + reach_)) + 1);
  return cv::Rect(first, last) & cv::Rect({0, 0}, work.features.size());
}

Result<std::vector<FaceCost>> Borders::costs_around(const PatchPlacements& placements,
                                                    const std::stop_token& stop) const {
  std::vector<PlacedFace> placed;
  for (std::size_t i = 0; i < problem_.queue.size(); ++i)
    placed.push_back({&problem_.artworks[problem_.queue[i].artwork], now_.outlines[i], &placements[i], window_of(i)});
  return wood_around(placed, panels_, kCurveError, options_.threads, stop);
}

void Borders::add_outlines(State& state) const {
  state.outlines.resize(problem_.queue.size());
  for (std::size_t a = 0; a < members_.size(); ++a) {
    for (std::size_t f = 0; f < members_[a].size(); ++f)
      state.outlines[members_[a][f]] = outline_of(state.layouts[a], f);
    state.curves += curve_length(state.layouts[a]);
  }
}

Result<PatchPlacements> Borders::settled(const PatchPlacements& wished, const PatchPlacements& before,
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

std::unique_ptr<Borders> make_borders(const Problem& problem, const std::vector<MatchPanel>& panels,
                                      const BoundaryOptions& options) {
  const bool free = std::all_of(problem.artworks.begin(), problem.artworks.end(),
                                [](const WorkingArtwork& it) { return it.layout && !it.lines; });
  if (free) return std::make_unique<EdgeCuts>(problem, panels, options);
  return std::make_unique<BoundaryCuts>(problem, panels, options);
}

}  // namespace veneer::planner
