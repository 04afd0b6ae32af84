#include "planner/boundaries/rematch.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/global/candidate_survey.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kRowStep = 6;                                   // of a coarse measurement
constexpr double kRematchHot = 0.006, kRematchCold = 0.0002;  // first and last temperature, in mean costs of a patch
constexpr std::uint64_t kRematchLeg = 2048;                   // iterations between looks at the stop token

// Every kRowStep-th row of a patch.
PatchPixels some_rows(const PatchPixels& pixels) {
  PatchPixels out = pixels;
  out.spans.clear();
  for (const PatchPixels::Span& span : pixels.spans)
    if (span.row % kRowStep == 0) out.spans.push_back(span);
  return out;
}

}  // namespace

Rematch::Rematch(const Problem& problem, const Matcher& matcher, const RematchOptions& options)
    : problem_(problem),
      matcher_(matcher),
      options_(options),
      grain_(problem, matcher.panels(), options.w_grain),
      known_(problem.queue.size()) {}

Result<Rematch> Rematch::survey(const Problem& problem, const Matcher& matcher, const RematchOptions& options,
                                const std::stop_token& stop) {
  Rematch out(problem, matcher, options);
  std::vector<Footprint> footprints;
  for (const Problem::Task& task : problem.queue)
    footprints.emplace_back(task.match.outline, matcher.panels().front().wood.kerf() + FreeWood::kSlack);
  const Result<Survey> survey =
      survey_candidates(problem, matcher, footprints, {}, {options.candidates, options.threads, &out.grain_}, stop);
  if (!survey.ok()) return survey.error();
  for (std::size_t i = 0; i < out.known_.size(); ++i)
    for (const Candidate& candidate : survey->candidates[i])
      out.known_[i].push_back({candidate.pose.panel, footprints[i].panel_from_artwork(candidate.pose), candidate.cost});
  for (const MatchPanel& panel : matcher.panels()) {
    // A border of pixels that are not free stands for all that lies beyond the raster.
    cv::Mat free, distance;
    cv::copyMakeBorder(panel.wood.raster().pixels, free, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
    cv::distanceTransform(free, distance, cv::DIST_L2, cv::DIST_MASK_5);
    out.clearance_.push_back(distance(cv::Rect({1, 1}, panel.wood.raster().pixels.size())).clone());
  }
  return out;
}

// Whether the patch lies on free wood by a raster: what is in doubt counts as not free.
bool Rematch::is_clear(const MatchPatch& patch, const PatchPlacement& placement) const {
  const auto p = static_cast<std::size_t>(placement.panel);
  const FreeWood& wood = matcher_.panels()[p].wood;
  const Raster<PanelFrame>& free = wood.raster();
  const cv::Mat& map = clearance_[p];
  // Distances are to pixels' middles, between pixels of this panel's own raster.
  const double border = free.resolution.to_px(wood.border()).count() + 1.5;
  const auto clear = [&](const Point<ArtworkFrame>& at) {
    double x = 0, y = 0;
    free.to_pixels(placement.panel_from_artwork * at, x, y);
    const auto c = static_cast<int>(std::floor(x)), r = static_cast<int>(std::floor(y));
    return c >= 0 && r >= 0 && c < map.cols && r < map.rows && static_cast<double>(map.at<float>(r, c)) >= border;
  };
  const Millimetres step = free.resolution.to_mm(Pixels(4));
  for (std::size_t i = 0; i < patch.outline.size(); ++i) {
    const auto &a = patch.outline[i], &b = patch.outline[(i + 1) % patch.outline.size()];
    const int steps = std::max(1, static_cast<int>(std::ceil(distance(a, b) / step)));
    for (int k = 0; k < steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      if (!clear({a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t})) return false;
    }
  }
  const ScanResolution& resolution = patch.grid.resolution;
  for (const PatchPixels::Span& span : patch.pixels.spans) {
    if (span.row % kRowStep != 0) continue;
    for (int c = span.begin; c < span.end; c += kRowStep)
      if (!clear({resolution.to_mm(Pixels(c + 0.5)), patch.grid.height - resolution.to_mm(Pixels(span.row + 0.5))}))
        return false;
  }
  return true;
}

Result<PatchPlacements> Rematch::choose(const std::vector<Ring<ArtworkFrame>>& outlines,
                                        const PatchPlacements& placements, std::uint64_t round,
                                        const std::stop_token& stop) const {
  const std::size_t count = outlines.size();
  const MatchPanel& any = matcher_.panels().front();
  GlobalSearch::Lists lists(count);
  GlobalSearch::State state;
  state.chosen.resize(count);
  std::vector<std::optional<Footprint>> made(count);
  const Status measured = run_parallel(count, options_.threads, stop, [&](std::size_t i) {
    const MatchPatch& cell = problem_.queue[i].match;
    MatchPatch patch = cell;
    patch.outline = outlines[i];
    patch.pixels = patch_pixels(outlines[i], cell.grid, cell.features->cols, cell.features->rows);
    made[i].emplace(patch.outline, any.wood.kerf() + FreeWood::kSlack);
    const auto cost_at = [&](const PatchPlacement& at, const PatchPixels& pixels) {
      return placement_cost(*cell.features, cell.grid, pixels,
                            matcher_.panels()[static_cast<std::size_t>(at.panel)].features, at.panel_from_artwork);
    };
    const PatchPixels coarse = some_rows(patch.pixels);
    std::vector<std::pair<double, std::size_t>> ranked;
    for (std::size_t k = 0; k < known_[i].size(); ++k) ranked.emplace_back(cost_at(known_[i][k], coarse), k);
    std::sort(ranked.begin(), ranked.end());
    std::vector<Candidate>& list = lists[i];
    const double importance = problem_.queue[i].importance;
    const auto add = [&](const PatchPlacement& at) {
      const Pose pose = made[i]->pose_of(at.panel, at.panel_from_artwork);
      list.push_back({pose, importance * (cost_at(at, patch.pixels) + grain_.cost(i, pose))});
    };
    for (const auto& [cost, k] : ranked) {
      if (list.size() >= options_.measured) break;
      if (is_clear(patch, known_[i][k])) add(known_[i][k]);
    }
    std::optional<Candidate> now;
    if (placements[i]) add(*placements[i]), now = list.back();
    std::sort(list.begin(), list.end(), cheaper);
    state.chosen[i] = GlobalSearch::number_in(list, now);
  });
  if (!measured.ok()) return measured.error();
  state.best = state.chosen;
  std::vector<Footprint> footprints;
  footprints.reserve(made.size());
  for (auto& it : made) footprints.push_back(std::move(*it));
  const Chosen before = chosen_from(lists, state.chosen);
  const Score start = score_of(before);
  const double mean = start.cost / std::max<double>(1, static_cast<double>(count - start.unfilled));
  GlobalSearch search(footprints, matcher_.panels(), std::move(lists), state, options_.seed + round);
  const Cooling cooling{kRematchHot * mean, kRematchCold * mean, options_.iterations * count};
  while (search.iteration() < cooling.iterations && !stop.stop_requested())
    search.run(cooling,
               std::min({search.iteration() + kRematchLeg, cooling.next_stage(search.iteration()), cooling.iterations}),
               stop);
  if (stop.stop_requested()) return cancelled();
  const Chosen& best = search.best();
  PatchPlacements out = placements;
  for (std::size_t i = 0; i < count; ++i) {
    if (!best[i] || (before[i] && best[i]->pose == before[i]->pose)) continue;
    out[i] = PatchPlacement{best[i]->pose.panel, footprints[i].panel_from_artwork(best[i]->pose),
                            best[i]->cost / problem_.queue[i].importance - grain_.cost(i, best[i]->pose)};
  }
  return out;
}

}  // namespace veneer::planner
