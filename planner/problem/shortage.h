// What was missing when wood ran out, in terms a person can act on. Pure functions.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// What patches have no wood; none when every one has its own. What wood is left is not asked: Shortage::left,
// behind_limits and smaller are not known.
std::optional<Shortage> missing_wood(const Problem& problem, const PatchPlacements& patches);

// The same, with what wood is left. `closed`: limits that refused wood to patches (problem/material_limits.h).
// kCancelled: a stop was requested.
Result<std::optional<Shortage>> shortage_of(const Problem& problem, const Matcher& matcher,
                                            const PatchPlacements& patches, Millimetres patch, LimitSet closed = {},
                                            const std::stop_token& stop = {});

// "no free wood was left for 12 of 600 patches (2352 mm2: ...)".
std::string what_is_missing(const Shortage& shortage, std::size_t pieces);
// The same, what is left, and a remedy reckoned from areas: "...; ...: make the picture about 23 % smaller, ...".
std::string sentence_of(const Shortage& shortage, std::size_t pieces);

}  // namespace veneer::planner
