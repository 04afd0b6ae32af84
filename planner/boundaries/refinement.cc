#include "planner/boundaries/refinement.h"

#include <algorithm>
#include <memory>

#include "planner/boundaries/borders.h"
#include "planner/boundaries/rematch.h"
#include "planner/parallel.h"
#include "planner/problem/free_layout.h"
#include "planner/stopwatch.h"

namespace veneer::planner {
namespace {

constexpr int kCuts = 4;           // after wood was chosen, at most
constexpr double kEnough = 0.002;  // share of the cost that a step must gain for another one to follow

class Refiner {
 public:
  Refiner(Problem& problem, const Matcher& matcher, PatchPlacements placements, const PlanOptions& options, int threads,
          const std::function<void(double)>& progress, const std::stop_token& stop)
      : problem_(problem),
        matcher_(matcher),
        options_(options),
        threads_(threads),
        progress_(progress),
        stop_(stop),
        borders_(make_borders(problem, matcher.panels(),
                              {options.overlap, options.curves == Curves::kG1 ? Smoothness::kG1 : Smoothness::kG0,
                               piece_limits(problem, options), threads})) {
    out_.patches = std::move(placements);
  }

  Result<Refinement> run(OnStop on_stop) {
    out_.report.cost_before = measured(borders_->outlines(), out_.patches);
    cost_ = out_.report.cost_before;
    const double rounds = 1 + options_.rematch;
    Status going = cut();
    progress_(1 / rounds);
    out_.report.cost_refined = cost_;
    if (going.ok() && options_.rematch > 0) going = choose_again();
    if (!going.ok() && on_stop == OnStop::kCancel) return going.error();
    out_.stopped = !going.ok();
    finish();
    return std::move(out_);
  }

 private:
  // Squares keep to what can be handled at all, what is laid out freely to what its layout keeps to.
  static PieceLimits piece_limits(const Problem& problem, const PlanOptions& options) {
    const bool free = std::any_of(problem.artworks.begin(), problem.artworks.end(),
                                  [](const WorkingArtwork& it) { return it.layout && !it.lines; });
    if (free) return {face_limits(options), handy_size(options)};
    return {moved_limits(options)};
  }
  // Of all pieces, in these shapes.
  double measured(const std::vector<Ring<ArtworkFrame>>& outlines, PatchPlacements& placements) const {
    std::vector<double> costs(outlines.size());
    (void)run_parallel(outlines.size(), threads_, {}, [&](std::size_t i) {
      if (!placements[i]) return;
      const MatchPatch& match = problem_.queue[i].match;
      const PatchPixels pixels = patch_pixels(outlines[i], match.grid, match.features->cols, match.features->rows);
      costs[i] = placement_cost(*match.features, match.grid, pixels,
                                matcher_.panels()[static_cast<std::size_t>(placements[i]->panel)].features,
                                placements[i]->panel_from_artwork);
      placements[i]->cost = costs[i];
    });
    double sum = 0;
    for (const double cost : costs) sum += cost;
    return sum;
  }

  // Borders are cut until that gains little. kCancelled: a stop was requested.
  Status cut() {
    for (int k = 0; k < kCuts; ++k) {
      const Borders::State before = borders_->state();
      if (Status done = borders_->cut(out_.patches, stop_); !done.ok()) return done;
      const double cost = measured(borders_->outlines(), out_.patches);
      if (cost >= cost_) {
        borders_->become(before);
        cost_ = measured(borders_->outlines(), out_.patches);
        break;
      }
      const bool enough = cost > cost_ * (1 - kEnough);
      cost_ = cost;
      if (enough) break;
    }
    return Ok();
  }

  Status choose_again() {
    Result<Rematch> rematch = Rematch::survey(
        problem_, matcher_, {.threads = threads_, .seed = options_.seed, .w_grain = options_.w_grain}, stop_);
    if (!rematch.ok()) return rematch.error();
    for (int round = 0; round < options_.rematch; ++round) {
      const Borders::State before = borders_->state();
      const PatchPlacements placements = out_.patches;
      const double cost = cost_;
      Status done = one_round(*rematch, static_cast<std::uint64_t>(round));
      // Half a round, or one that gained nothing, is taken back.
      if (!done.ok() || cost_ >= cost) {
        borders_->become(before), out_.patches = placements, cost_ = cost;
        return done;
      }
      std::size_t moved = 0;
      for (std::size_t i = 0; i < placements.size(); ++i)
        moved += out_.patches[i] && !same_place(*out_.patches[i], *placements[i]) ? 1 : 0;
      out_.report.rounds.push_back({cost_, moved});
      progress_(static_cast<double>(round + 2) / (options_.rematch + 1));
      if (cost_ > cost * (1 - kEnough)) break;
    }
    return Ok();
  }

  static bool same_place(const PatchPlacement& a, const PatchPlacement& b) {
    return a.panel == b.panel && a.panel_from_artwork.shift() == b.panel_from_artwork.shift() &&
           a.panel_from_artwork.angle().count() == b.panel_from_artwork.angle().count();
  }

  Status one_round(const Rematch& rematch, std::uint64_t round) {
    Result<PatchPlacements> chosen = rematch.choose(borders_->outlines(), out_.patches, round, stop_);
    if (!chosen.ok()) return chosen.error();
    // Footprints are wider than the rule, but the raster that says what is free is not exact.
    Result<PatchPlacements> settled = borders_->settled(*chosen, out_.patches, stop_);
    if (!settled.ok()) return settled.error();
    out_.patches = *std::move(settled);
    cost_ = measured(borders_->outlines(), out_.patches);
    return cut();
  }

  // Tasks and artworks get the shapes that there are now.
  void finish() {
    for (std::size_t i = 0; i < problem_.queue.size(); ++i) {
      Problem::Task& task = problem_.queue[i];
      Patch& patch = problem_.artworks[task.artwork].patches[task.patch];
      patch.outline = task.match.outline = borders_->outlines()[i];
      task.match.pixels =
          patch_pixels(patch.outline, task.match.grid, task.match.features->cols, task.match.features->rows);
    }
    out_.layouts = borders_->state().layouts;
    for (std::size_t a = 0; a < out_.layouts.size(); ++a) out_.faces.push_back(borders_->faces(a));
    out_.report.cost = measured(borders_->outlines(), out_.patches);
    const CurveLength& curves = borders_->state().curves;
    out_.report.pixel_cut = borders_->state().pixel_cut;
    out_.report.segments = curves.segments, out_.report.length = curves.length;
  }

  Problem& problem_;
  const Matcher& matcher_;
  const PlanOptions& options_;
  int threads_;
  const std::function<void(double)>& progress_;
  const std::stop_token& stop_;
  std::unique_ptr<Borders> borders_;
  double cost_ = 0;
  Refinement out_;
};

}  // namespace

Result<Refinement> refine_boundaries(Problem& problem, const Matcher& matcher, PatchPlacements placements,
                                     const PlanOptions& options, int threads,
                                     const std::function<void(double)>& progress, const std::stop_token& stop,
                                     OnStop on_stop) {
  return Refiner(problem, matcher, std::move(placements), options, threads, progress, stop).run(on_stop);
}

}  // namespace veneer::planner
