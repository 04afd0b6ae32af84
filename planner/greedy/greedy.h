// The greedy algorithm (section 3.3): each patch in turn takes the cheapest candidate that is still free.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "planner/files/plan_journal.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// One candidate for each patch of the queue, none where no wood was left; the matcher's wood is taken. Patches choose
// in the queue's order, but several search at once; the choices are the same for any number of threads. `on_placed`
// gets the number of patches that have chosen. `journal`: see make_plan. `use`: what is used of limited woods already,
// and then also by these patches; once a patch would exceed a limit, all wood under it is taken from the matcher, and
// its number is added to `closed`. kCancelled: a stop was requested.
Result<std::vector<std::optional<LatticeCandidate>>> place_in_turn(const Problem& problem, Matcher& matcher,
                                                                   int threads, const std::stop_token& stop,
                                                                   const std::function<void(std::size_t)>& on_placed,
                                                                   PlanJournal* journal = nullptr,
                                                                   MaterialUse* use = nullptr,
                                                                   std::vector<int>* closed = nullptr);

}  // namespace veneer::planner
