#include "planner/global/global_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planner/cancelled.h"
#include "planner/global/candidate_survey.h"
#include "planner/global/global_journal.h"
#include "planner/global/global_search.h"
#include "planner/global/packing.h"
#include "planner/parallel.h"
#include "planner/poses/admission.h"
#include "planner/stopwatch.h"

namespace veneer::planner {
namespace {

constexpr double kSurveyShare = 0.4;  // of the time
// Iterations a patch: more gain little.
constexpr std::uint64_t kIterationsAPatch = 4000;
constexpr double kHot = 0.02, kCold = 0.0003;  // first and last temperature, in mean costs of a patch
constexpr std::uint64_t kLeg = 2048;           // iterations between reports and looks at the clock, at most
constexpr std::size_t kCandidates = 300;       // a patch, to choose from

// An arrangement whose costs are measured and whose outlines are all admitted.
struct Verified {
  Chosen chosen;              // costs with the grain's, weighed by importance
  std::vector<double> costs;  // as they are
  Score score;
};

class GlobalPlanner {
 public:
  GlobalPlanner(const Problem& problem, const Matcher& matcher,
                const std::vector<std::optional<LatticeCandidate>>& greedy, const PlanOptions& options, int threads,
                const GlobalProgress& progress, const std::stop_token& stop, const MaterialUse& others)
      : problem_(problem),
        matcher_(matcher),
        greedy_placements_(placements_of(problem, matcher, greedy)),
        options_(options),
        threads_(threads),
        progress_(progress),
        stop_(stop),
        others_(others),
        grain_(problem, matcher.panels(), options.w_grain) {
    for (const Problem::Task& task : problem.queue)
      footprints_.emplace_back(task.match.outline, options.kerf_and_web() + FreeWood::kSlack);
    for (std::size_t i = 0; i < greedy.size(); ++i) {
      greedy_.chosen.emplace_back(), greedy_.costs.push_back(0);
      if (!greedy[i]) continue;
      greedy_.costs[i] = greedy[i]->cost;
      const Pose pose = footprints_[i].pose_of(greedy[i]->panel, greedy_placements_[i]->panel_from_artwork);
      greedy_.chosen[i] = Candidate{pose, weighed(i, pose, greedy[i]->cost)};
    }
    greedy_.score = score_of(greedy_.chosen);
    best_ = greedy_;
  }

  Result<GlobalOutcome> run(GlobalJournal journal, OnStop on_stop) {
    GlobalReport report;
    report.greedy_cost = greedy_.score.cost, report.greedy_unfilled = greedy_.score.unfilled;
    report.budget = kIterationsAPatch * greedy_.chosen.size();
    std::optional<LimitSet> refused;
    if (Result<GlobalSearch> search = begun(journal); search.ok()) {
      improve(*search, journal, report);
      refused = refusing(search->lists());
    }
    if (stop_.stop_requested() && on_stop == OnStop::kCancel) return cancelled();
    report.iterations = best_at_;
    report.stopped = report.iterations < report.budget;
    report.cost = best_.score.cost, report.unfilled = best_.score.unfilled;
    report.seconds = begin_.seconds();
    return GlobalOutcome{placements(), report, refused};
  }

 private:
  // The search at its beginning, or where an earlier run left it. kCancelled: a stop was requested.
  Result<GlobalSearch> begun(GlobalJournal& journal) {
    GlobalSearch::State state;
    Result<std::optional<GlobalSearch::Lists>> kept = journal.lists(greedy_.chosen.size(), stop_);
    if (!kept.ok()) return kept.error();
    std::optional<GlobalSearch::Lists>& lists = *kept;
    std::optional<GlobalSearch::State> remembered = lists ? journal.next_state(*lists) : std::nullopt;
    if (!remembered) {
      Result<Start> start = surveyed();
      if (!start.ok()) return start.error();
      lists = std::move(start->lists), remembered = std::move(start->state);
      if (const Status added = journal.add(*lists, stop_); !added.ok()) return added.error();
      journal.add(*remembered);
    }
    for (; remembered; remembered = journal.next_state(*lists)) {
      state = std::move(*remembered);
      if (state.iteration > 0) settle_for(chosen_from(*lists, state.best), state.iteration);
    }
    return GlobalSearch(footprints_, matcher_.panels(), std::move(*lists), state, options_.seed, search_limits());
  }

  std::optional<SearchLimits> search_limits() const {
    if (problem_.limits.empty()) return std::nullopt;
    SearchLimits out{&problem_.limits, {}, others_};
    for (const Problem::Task& task : problem_.queue) out.areas.push_back(area_of(task.match.outline));
    return out;
  }

  // Whether these keep to the limits of woods.
  bool within_limits(const Chosen& chosen) const {
    if (problem_.limits.empty()) return true;
    MaterialUse use = others_;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!chosen[i]) continue;
      const Pose& pose = chosen[i]->pose;
      const LimitSet under = limits_at(pose);
      const SquareMillimetres area = area_of(problem_.queue[i].match.outline);
      if (!use.has_room(under, area)) return false;
      use.add(under, area);
    }
    return true;
  }

  LimitSet limits_at(const Pose& pose) const {
    return problem_.limits.at(pose.panel, {Millimetres(pose.x), Millimetres(pose.y)});
  }

  // Limits but for which a patch would have a cheaper place that is free in the end, or any. That is asked of what is
  // settled, not counted during the search, since one that goes on from a journal has not seen its beginning.
  LimitSet refusing(const GlobalSearch::Lists& lists) const {
    LimitSet out;
    if (problem_.limits.empty()) return out;
    Arrangement arrangement(footprints_, matcher_.panels());
    MaterialUse use = others_;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      if (!best_.chosen[i]) continue;
      arrangement.put(i, best_.chosen[i]->pose);
      use.add(limits_at(best_.chosen[i]->pose), area_of(problem_.queue[i].match.outline));
    }
    for (std::size_t i = 0; i < lists.size(); ++i) {
      const auto& mine = best_.chosen[i];
      const SquareMillimetres area = area_of(problem_.queue[i].match.outline);
      if (mine) use.remove(limits_at(mine->pose), area);
      for (const Candidate& place : lists[i]) {
        if (mine && place.cost >= mine->cost) break;
        const LimitSet refused = use.refused(limits_at(place.pose), area);
        if ((refused | out) != out && !arrangement.any_in_the_way(i, place.pose)) out = out | refused;
      }
      if (mine) use.add(limits_at(mine->pose), area);
    }
    return out;
  }

  struct Start {
    GlobalSearch::Lists lists;
    GlobalSearch::State state;
  };
  // kCancelled: a stop was requested.
  Result<Start> surveyed() const {
    Chosen start = greedy_.chosen;
    std::vector<Pose> slots;
    if (greedy_.score.unfilled > 0) {
      Result<std::vector<Pose>> poses = packed();
      if (!poses.ok()) return poses.error();
      slots = std::move(*poses);
    }
    progress_(0, "surveying the wood");
    Result<Survey> survey =
        survey_candidates(problem_, matcher_, footprints_, slots, {kCandidates, threads_, &grain_}, stop_,
                          [&](double share) { progress_(kSurveyShare * share, "surveying the wood"); });
    if (!survey.ok()) return survey.error();
    for (std::size_t i = 0; i < start.size(); ++i) {
      for (Candidate& candidate : survey->candidates[i]) candidate.cost *= problem_.queue[i].importance;
      for (AssignmentCost& slot : survey->slots[i]) slot.cost *= problem_.queue[i].importance;
    }
    if (!slots.empty()) {
      Result<Chosen> on_slots = each_on_a_slot(slots, survey->slots);
      if (!on_slots.ok()) return on_slots.error();
      // Packing knows nothing of limits.
      if (score_of(*on_slots).unfilled < greedy_.score.unfilled && within_limits(*on_slots))
        start = std::move(*on_slots);
    }
    Start out{std::move(survey->candidates), {}};
    for (std::size_t i = 0; i < start.size(); ++i) {
      if (stop_.stop_requested()) return cancelled();
      std::vector<Candidate>& list = out.lists[i];
      for (const AssignmentCost& slot : survey->slots[i]) list.push_back({slots[slot.column], slot.cost});
      for (const auto& candidate : {greedy_.chosen[i], start[i]})
        if (candidate) list.push_back(*candidate);
      std::sort(list.begin(), list.end(), cheaper);
      out.state.chosen.push_back(GlobalSearch::number_in(list, start[i]));
    }
    out.state.best = out.state.chosen;
    return out;
  }

  // Where the patches would fit if they were packed closely; all are taken as large as the largest.
  Result<std::vector<Pose>> packed() const {
    progress_(0, "packing the wood");
    Millimetres width, height;
    for (const Problem::Task& task : problem_.queue) {
      const Box<ArtworkFrame> box = bounds(task.match.outline);
      width = std::max(width, box.width()), height = std::max(height, box.height());
    }
    return pack_rectangles(matcher_, width, height, greedy_.chosen.size(), threads_, stop_);
  }

  // The cheapest assignment of patches to slots. Where slots are short, the first in the queue have them: to go without
  // costs more the earlier a patch is there, and by more than all candidates together differ. kCancelled: a stop was
  // requested.
  Result<Chosen> each_on_a_slot(const std::vector<Pose>& slots,
                                const std::vector<std::vector<AssignmentCost>>& costs) const {
    const std::size_t count = greedy_.chosen.size();
    double most = 0;
    for (const auto& row : costs)
      for (const AssignmentCost& slot : row) most = std::max(most, slot.cost);
    std::vector<double> unassigned;
    for (std::size_t i = 0; i < count; ++i)
      unassigned.push_back(most * static_cast<double>(count) * static_cast<double>(2 * count - i));
    const auto assigned = solve_linear_assignment(costs, unassigned, slots.size(), stop_);
    if (!assigned.ok()) return assigned.error();
    Chosen out(count);
    std::vector<bool> is_taken(slots.size());
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<std::uint32_t> column = (*assigned)[i];
      if (!column) continue;
      const AssignmentCost& slot = *std::find_if(costs[i].begin(), costs[i].end(),
                                                 [&](const AssignmentCost& it) { return it.column == *column; });
      is_taken[slot.column] = true;
      out[i] = Candidate{slots[slot.column], slot.cost};
    }
    // Where others have all the cheapest, any slot.
    for (std::size_t i = 0, next = 0; i < count; ++i) {
      if (stop_.stop_requested()) return cancelled();
      if (out[i]) continue;
      while (next < slots.size() && is_taken[next]) ++next;
      if (next == slots.size()) break;
      out[i] = Candidate{slots[next], weighed(i, slots[next], measured(i, slots[next]))};
      ++next;
    }
    return out;
  }

  void improve(GlobalSearch& search, GlobalJournal& journal, const GlobalReport& report) {
    const double filled = static_cast<double>(greedy_.chosen.size() - report.greedy_unfilled);
    const double mean = report.greedy_cost / std::max(1.0, filled);
    const Cooling cooling{kHot * mean, kCold * mean, report.budget};
    const std::uint64_t last =
        options_.optimize_iterations > 0 ? std::min(options_.optimize_iterations, report.budget) : report.budget;
    while (search.iteration() < last && !stop_.stop_requested()) {
      const std::uint64_t stage = cooling.next_stage(search.iteration());
      search.run(cooling, std::min({search.iteration() + kLeg, stage, last}), stop_);
      tell(search, static_cast<double>(search.iteration()) / static_cast<double>(last));
      const bool ends_stage = search.iteration() == stage, in_time = !out_of_time();
      if (ends_stage && search.iteration() < last) journal.add(search.state());
      if (ends_stage || search.iteration() == last || !in_time) settle_for(search.best(), search.iteration());
      if (!in_time) return;
    }
  }

  void tell(const GlobalSearch& search, double share) const {
    const Score& best = search.best_score();
    progress_(kSurveyShare + (1 - kSurveyShare) * share,
              best.unfilled > 0
                  ? fmt::format("optimising: {} patches are unfilled", best.unfilled)
                  : fmt::format("optimising: {:.1f} % below greedy", 100 * (1 - best.cost / greedy_.score.cost)));
  }

  bool out_of_time() const { return options_.optimize_seconds > 0 && begin_.seconds() >= options_.optimize_seconds; }

  // From now on `chosen`, found after so many iterations, is what this returns, if it is better and can be cut. All of
  // that is done while there is time, so that nothing is left to do once a stop is requested; then nothing changes.
  void settle_for(const Chosen& chosen, std::uint64_t iterations) {
    Result<Verified> better = with_costs(chosen);
    if (!better.ok()) return;
    const Result<std::size_t> refused = put_back(*better);
    if (!refused.ok()) return;
    // The search gets ever better by its own measure, which counts who goes without; here greedy is what matters. What
    // patches were put back for may have been its whole gain.
    const bool settled = within_limits(better->chosen) && better->score < greedy_.score &&
                         (*refused == 0 || better->score < best_.score);
    if (stop_.stop_requested()) return;
    if (settled) best_ = std::move(*better);
    best_at_ = iterations;
  }

  // What counts where patches compete.
  double weighed(std::size_t patch, const Pose& pose, double cost) const {
    return problem_.queue[patch].importance * (cost + grain_.cost(patch, pose));
  }

  double measured(std::size_t patch, const Pose& pose) const {
    const MatchPatch& match = problem_.queue[patch].match;
    return placement_cost(*match.features, match.grid, match.pixels,
                          matcher_.panels()[static_cast<std::size_t>(pose.panel)].features,
                          footprints_[patch].panel_from_artwork(pose));
  }

  // kCancelled: a stop was requested.
  Result<Verified> with_costs(const Chosen& chosen) const {
    Verified out{chosen, std::vector<double>(chosen.size()), {}};
    const Status done = run_parallel(chosen.size(), threads_, stop_, [&](std::size_t i) {
      if (!chosen[i]) return;
      for (const Verified* known : {&best_, &greedy_})
        if (known->chosen[i] && known->chosen[i]->pose == chosen[i]->pose) {
          out.chosen[i] = known->chosen[i], out.costs[i] = known->costs[i];
          return;
        }
      out.costs[i] = measured(i, chosen[i]->pose);
      out.chosen[i]->cost = weighed(i, chosen[i]->pose, out.costs[i]);
    });
    if (!done.ok()) return done.error();
    out.score = score_of(out.chosen);
    return out;
  }

  // The final word: patches whose outlines are not admitted go back to where they were settled, and so do those that
  // took their places. How many. kCancelled: a stop was requested.
  Result<std::size_t> put_back(Verified& verified) const {
    const auto outlines = [&](const Chosen& chosen) {
      PlacedOutlines out(chosen.size());
      for (std::size_t i = 0; i < out.size(); ++i)
        if (chosen[i])
          out[i] = PlacedOutline{chosen[i]->pose.panel,
                                 footprints_[i].panel_from_artwork(chosen[i]->pose) * problem_.queue[i].match.outline};
      return out;
    };
    const PlacedOutlines wished = outlines(verified.chosen), before = outlines(best_.chosen);
    const Result<std::vector<bool>> moves = admitted(wished, before, matcher_.panels(), stop_);
    if (!moves.ok()) return moves.error();
    std::size_t refused = 0;
    for (std::size_t i = 0; i < wished.size(); ++i) {
      if ((*moves)[i] || wished[i] == before[i]) continue;
      verified.chosen[i] = best_.chosen[i], verified.costs[i] = best_.costs[i];
      ++refused;
    }
    verified.score = score_of(verified.chosen);
    return refused;
  }

  PatchPlacements placements() const {
    PatchPlacements out(best_.chosen.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (!best_.chosen[i]) continue;
      const Pose& pose = best_.chosen[i]->pose;
      // What greedy chose stays as it was, to the last bit.
      const bool kept = greedy_.chosen[i] && pose == greedy_.chosen[i]->pose;
      out[i] = kept ? greedy_placements_[i]
                    : PatchPlacement{pose.panel, footprints_[i].panel_from_artwork(pose), best_.costs[i]};
    }
    return out;
  }

  const Problem& problem_;
  const Matcher& matcher_;
  PatchPlacements greedy_placements_;
  const PlanOptions& options_;
  int threads_;
  const GlobalProgress& progress_;
  const std::stop_token& stop_;
  MaterialUse others_;  // what kept pieces take of limited woods
  GrainPull grain_;
  Stopwatch begin_;
  std::vector<Footprint> footprints_;
  Verified greedy_, best_;
  std::uint64_t best_at_ = 0;
};

}  // namespace

PatchPlacements placements_of(const Problem& problem, const Matcher& matcher,
                              const std::vector<std::optional<LatticeCandidate>>& chosen) {
  PatchPlacements out;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    out.emplace_back();
    if (!chosen[i]) continue;
    const LatticeCandidate& it = *chosen[i];
    out.back() = PatchPlacement{it.panel, matcher.panel_from_artwork(problem.queue[i].match, it), it.cost};
  }
  return out;
}

Result<GlobalOutcome> plan_globally(const Problem& problem, const Matcher& matcher,
                                    const std::vector<std::optional<LatticeCandidate>>& greedy,
                                    const PlanOptions& options, int threads, const GlobalProgress& progress,
                                    const std::stop_token& stop, PlanJournal* journal, const MaterialUse* others,
                                    OnStop on_stop) {
  const MaterialUse none(problem.limits);
  return GlobalPlanner(problem, matcher, greedy, options, threads, progress, stop, others != nullptr ? *others : none)
      .run(GlobalJournal(journal), on_stop);
}

}  // namespace veneer::planner
