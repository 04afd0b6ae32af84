// Beyond greedy: all patches choose together (`--optimize global`). The paper calls that prohibitive; with
// candidate lists it takes a few times as long as greedy.
//
// From greedy's plan: candidate lists over all wood (candidate_survey.h), annealing with ejections (global_search.h).
// The result is never worse than greedy's: no more patches unfilled, and with equally many a cost no higher.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/files/plan_journal.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// The placements of what greedy has chosen.
PatchPlacements placements_of(const Problem& problem, const Matcher& matcher,
                              const std::vector<std::optional<LatticeCandidate>>& chosen);

// What the optimisation did.
struct GlobalOutcome {
  PatchPlacements patches;
  GlobalReport report;
  // Limits but for which a patch would have a cheaper place, or any; none: nobody chose together, because a stop was
  // requested before (OnStop::kBestSoFar).
  std::optional<LimitSet> refused;
};

// Called on the calling thread, often, with the share done.
using GlobalProgress = std::function<void(double share, const std::string& text)>;

// `matcher` with its index built; its wood may have been taken. The same for any number of threads; only `stop` and
// PlanOptions::optimize_seconds depend on time. Once `stop` is requested it returns within 100 ms: kCancelled, or with
// OnStop::kBestSoFar the best of the last stage that it has finished (a sixteenth of the iterations), at least
// `greedy`; its report says after how many iterations that was. `journal`: see make_plan. `others`: what pieces that
// are not in the queue take of limited woods.
Result<GlobalOutcome> plan_globally(const Problem& problem, const Matcher& matcher,
                                    const std::vector<std::optional<LatticeCandidate>>& greedy,
                                    const PlanOptions& options, int threads, const GlobalProgress& progress,
                                    const std::stop_token& stop, PlanJournal* journal = nullptr,
                                    const MaterialUse* others = nullptr, OnStop on_stop = OnStop::kCancel);

}  // namespace veneer::planner
