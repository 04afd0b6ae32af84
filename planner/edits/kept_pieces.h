// Pieces of an earlier plan that stay where they are when the rest is planned again.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct KeptPatches {
  std::vector<Problem::Task> tasks;
  PatchPlacements placements;  // one a task, all of them filled
};

// Takes what PlanOptions::kept keeps out of the problem's queue, and its wood from the panels before anything is
// indexed. Tones stay mapped to all the wood, so that kept pieces fit the others as before.
//
// kInvalidArgument: a mark that no patch has, or a piece that must stay and cannot: its wood is not free, or another
// piece that must stay has it. kCancelled: a stop was requested.
Result<KeptPatches> keep_pieces(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                const PlanOptions& options, Problem& problem, const std::stop_token& stop);

}  // namespace veneer::planner
