// Alternatives of the pieces of a plan: other places to cut them from, for a person to choose among.
//
// What is offered may be taken: no place is listed that would break a limit of its wood (problem/material_limits.h) if
// that piece alone went there, its own wood being given back. Of two pieces that both go there that is not known; then
// the plan says so (problem/material_shares.h).
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// Up to `count` for each task of the queue, the cheapest first. `placements`: of the whole queue; the first `taken` of
// them the matcher knows as taken, the wood of the others was gone before it was indexed. Where limits close wood to
// some pieces the matcher does not know any more, in the end, what is taken. Deterministic, any number of threads.
// kCancelled: a stop was requested, and the matcher must not be asked any more.
Result<std::vector<std::vector<Alternative>>> find_alternatives(std::span<const StockPanel> stock,
                                                                const Problem& problem, Matcher& matcher,
                                                                const PatchPlacements& placements, std::size_t taken,
                                                                std::size_t count, int threads,
                                                                const std::stop_token& stop);

}  // namespace veneer::planner
