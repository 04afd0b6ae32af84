// What a matcher knows to be taken.
#pragma once

#include <span>
#include <stop_token>

#include "base/result.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// From now on the matcher knows as taken what these placements take, and nothing else, whoever moved pieces since they
// were placed or closed wood to them. They are those of the first tasks of the queue. kCancelled: a stop was requested,
// and the matcher must not be asked any more.
Status take_anew(Matcher& matcher, const Problem& problem, std::span<const std::optional<PatchPlacement>> placements,
                 int threads, const std::stop_token& stop);

}  // namespace veneer::planner
