// For every patch the best candidates of the whole stock, spread over it: what the global choice chooses from.
//
// The wood is looked at region by region (squares of a third of a patch); in each, every patch keeps the one candidate,
// of a grid of positions and all rotations, whose rough cost (rough_cost.h) is lowest among those that the discs in its
// outline do not rule out. Whether it stands is asked later, but where the patches of a class are alike: there it is
// asked first. The best regions of each patch are thinned, laid on the matcher's lattice and measured exactly. A
// candidate stands on free wood, so a region may come to nothing; other placements are not looked at.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/global/linear_assignment.h"
#include "planner/grain/grain_pull.h"
#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct SurveyOptions {
  std::size_t candidates = 300;  // a patch, at most; half as many slots
  int threads = 1;
  const GrainPull* grain = nullptr;  // adds to all costs; none: costs are equation 4
};

// Two lists a task of the queue: candidates found, cheapest first, and the cheapest of the slots that were given, each
// a column of an assignment of patches to slots.
struct Survey {
  std::vector<std::vector<Candidate>> candidates;
  std::vector<std::vector<AssignmentCost>> slots;
};

// All panels of the matcher share one kerf and border (FreeWood). Deterministic, any number of threads; `progress` is
// called on the calling thread with the share done. kCancelled: a stop was requested.
Result<Survey> survey_candidates(const Problem& problem, const Matcher& matcher, std::span<const Footprint> footprints,
                                 std::span<const Pose> slots, const SurveyOptions& options, const std::stop_token& stop,
                                 const std::function<void(double)>& progress = {});

}  // namespace veneer::planner
