// Pieces turned and shifted continuously once all have their placements (`--fine-rotation`).
//
// A search chooses among n_rot rotations and whole pixels; the best pose nearby usually lies between them. Each
// piece tries steps along its sides and about its centre, wide ones first, and takes what is cheaper by equation 4 in
// double precision, so no piece becomes dearer and its cost is that of what is placed. A pose counts when its outline
// keeps to the rules of free_wood.h against all other pieces where they then lie, in whichever order they are admitted,
// and when its middle stays in wood of the same limits (problem/material_limits.h), which so keep what they have.
//
// Pieces move one after another, in the order of the queue. None goes further than a few pixels, so those that cannot
// reach each other are searched at the same time: the result is the same for any number of threads.
#pragma once

#include <functional>
#include <stop_token>

#include "base/result.h"
#include "planner/files/plan_journal.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct FineOutcome {
  PatchPlacements patches;
  FineReport report;
  bool stopped = false;  // before all were turned: the others lie where they lay (OnStop::kBestSoFar)
};

// `patches`: one a task of the problem's queue, on wood that `matcher` had free at its beginning. `progress` gets the
// share done, on the calling thread. `journal`: see make_plan. kCancelled: a stop was requested before all were turned,
// with OnStop::kCancel.
Result<FineOutcome> turn_finely(const Problem& problem, const Matcher& matcher, PatchPlacements patches, int threads,
                                const std::function<void(double)>& progress, const std::stop_token& stop,
                                PlanJournal* journal = nullptr, OnStop on_stop = OnStop::kCancel);

}  // namespace veneer::planner
