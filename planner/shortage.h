// What was missing when wood ran out, in terms a person can act on. Pure functions.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "planner/matcher.h"
#include "planner/plan.h"
#include "planner/problem.h"

namespace veneer::planner {

// None when every patch has its wood. `chosen` holds a place, or none, for each task of the problem's queue.
std::optional<Shortage> shortage_of(const Problem& problem, const Matcher& matcher,
                                    std::span<const std::optional<Candidate>> chosen, Millimetres patch);

// "no free wood was left for 12 of 600 patches (2352 mm2: ...); ...".
std::string sentence_of(const Shortage& shortage, std::size_t pieces);

}  // namespace veneer::planner
