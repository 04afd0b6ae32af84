// Borders that follow the picture, and wood chosen again for the pieces that they make (paper, section 3.4, a
// posteriori refinement, equations 8 and 9).
//
// Once wood is chosen, each piece may grow over its neighbours as far as the wood around it is free, and each border
// goes where the two pieces beside it together show the picture best. What a piece gives up is free for its panel's
// others, so borders are cut several times. Then what the paper could not afford: wood is chosen again for the real
// shapes, and borders are cut again, until nothing improves.
//
// At every step the partition is fabricable (fabrication.h), where the layout was, and keeps to the rules of
// free_wood.h: a border that does not is drawn back towards where it was before, as far as is needed.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/layout/partition.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct Refinement {
  PatchPlacements patches;                      // one a task, with the cost of its real shape
  std::vector<Partition> layouts;               // one an artwork
  std::vector<std::vector<std::size_t>> faces;  // of each layout: the tasks of its faces, as places in the queue
  RefineReport report;
  bool stopped = false;  // before all was done: as it was after the last step (OnStop::kBestSoFar)
};

// Gives the queue's tasks, whose patches cover their artworks, their real shapes. `placements`: one a task, on wood
// that `matcher` had free at its beginning. `progress` gets the share done, on the calling thread. The same for any
// number of threads. kCancelled: a stop was requested before all was done, with OnStop::kCancel, and the tasks are as
// they were.
Result<Refinement> refine_boundaries(Problem& problem, const Matcher& matcher, PatchPlacements placements,
                                     const PlanOptions& options, int threads,
                                     const std::function<void(double)>& progress, const std::stop_token& stop,
                                     OnStop on_stop = OnStop::kCancel);

}  // namespace veneer::planner
