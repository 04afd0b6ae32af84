// The greedy algorithm (section 3.3): each patch in turn takes the cheapest place that is still free.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "planner/matching/matcher.h"
#include "planner/plan_journal.h"
#include "planner/problem.h"

namespace veneer::planner {

// One place for each patch of the queue, none where no wood was left; the matcher's wood is taken. Patches choose in
// the queue's order, but several search at once; the choices are the same for any number of threads. `on_placed` gets
// the number of patches that have chosen. Once `stop` is requested it returns early, with anything. `journal`: see
// make_plan.
std::vector<std::optional<Candidate>> place_in_turn(const Problem& problem, Matcher& matcher, int threads,
                                                    const std::stop_token& stop,
                                                    const std::function<void(std::size_t)>& on_placed,
                                                    PlanJournal* journal = nullptr);

}  // namespace veneer::planner
