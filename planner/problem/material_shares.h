// What the limits of woods (material_limits.h) came to in a plan, and what is said of them.
#pragma once

#include <span>

#include "planner/plan.h"
#include "planner/problem/material_limits.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

// Adds Plan::material_shares and a warning for each limit that was broken or refused wood. A limit is broken only by
// what a person keeps or moves, which goes where it is told to (PlanOptions::kept): the warning names pieces that were
// moved to that wood. `patches`: of the whole queue; `refused`: limits that refused wood to a patch; `plan` has its
// pieces and its shortage.
void note_material_shares(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const Problem& problem,
                          const PlanOptions& options, const PatchPlacements& patches, LimitSet refused, Plan& plan);

}  // namespace veneer::planner
