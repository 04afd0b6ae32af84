// What was missing when wood ran out, in terms a person can act on. Pure functions.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem.h"

namespace veneer::planner {

// None when every patch has its wood. Once `stop` is requested it returns early, without a word on the wood that is
// left.
std::optional<Shortage> shortage_of(const Problem& problem, const Matcher& matcher, const LaidPatches& patches,
                                    Millimetres patch, const std::stop_token& stop = {});

// "no free wood was left for 12 of 600 patches (2352 mm2: ...); ...".
std::string sentence_of(const Shortage& shortage, std::size_t pieces);

}  // namespace veneer::planner
