// Plans as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/job_wood_json.h"
#include "daemon/orders/plan_work.h"
#include "daemon/orders/records_json.h"

namespace veneer::planner {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GlobalReport, greedy_cost, cost, greedy_unfilled, unfilled, iterations, budget,
                                   stopped, seconds)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FineReport, cost_before, cost, moved)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RefineReport::Round, cost, moved)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RefineReport, cost_before, cost_refined, cost, rounds, segments, length, seconds)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PlanEdits, pins, replanned, swaps, takes, held)

}  // namespace veneer::planner

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RecipeConfig, cut_speed, cut_power, engrave_speed, engrave_power, mark_height,
                                   mark_min_height, fit_clearance, lead_in, bridges, cut_order)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MakePlan, name, picture, crop, size, options, large_edges, fine_edges,
                                   pinned_vertices, cell_sizes, flow_lines, segmentation, importance, threads, kerf,
                                   preview_dpi, wood, recipe, recipes, earlier, edits, limit_s)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RedonePiece, mark, cost_before, cost)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PlanMade, kerf, web, cost_per_pixel, without_lead, warnings, global, fine, refined,
                                   redone, cost_before, cutting_s)

}  // namespace veneer::daemon
