// Patches of several sizes (section 3.3): a large patch stays where it is nearly as good as four smaller ones.
//
// The sentence in 3.3 would break a patch when four are cheaper than w_adaptive times its cost, so that a larger factor
// breaks more; figure 11 shows the opposite, and so does this: a patch stays when its cost per pixel is at most
// w_adaptive times that of its parts. More w_adaptive, fewer pieces.
//
// Whole squares choose in the order of the queue. All sizes within a square are asked about on the same wood, the parts
// among themselves do not share wood, and what is cheapest under the rule is taken before the next square chooses. So
// the result does not depend on the number of threads.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "planner/files/plan_journal.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// Lets every square of the problem choose, and fills problem.queue with the patches that came of it, in order. The
// answer is a candidate for each of them; none where no wood was left. `on_placed` gets the number of squares that have
// chosen. `journal` as in make_plan. kCancelled: a stop was requested, and the queue is of no use.
Result<std::vector<std::optional<LatticeCandidate>>> place_squares(Problem& problem, double factor, Matcher& matcher,
                                                                   int threads, const std::stop_token& stop,
                                                                   const std::function<void(std::size_t)>& on_placed,
                                                                   PlanJournal* journal = nullptr);

}  // namespace veneer::planner
