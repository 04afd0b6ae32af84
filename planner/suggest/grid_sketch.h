// About where the lines of a morphed grid will be, while somebody moves a slider, paints edges or pins vertices.
#pragma once

#include <stop_token>

#include "planner/morph/edge_image.h"
#include "planner/morph/grid_preview.h"
#include "planner/plan.h"

namespace veneer::planner {

// kCoarse follows a hand; kFine takes a plan's own steps and about as long as a plan's layout does.
enum class GridEffort { kCoarse, kFine };

inline constexpr int kMostSketchedCells = 3000;

// `options` are those of the plan to come, `artwork.guides` what somebody says of its edges and vertices. What differs
// from the plan's: tones are the picture's own and not mapped to the wood's. Cells that are cut into triangles are told
// as they were before the cut. kInvalidArgument: as make_plan, or there would be more cells than kMostSketchedCells.
// kCancelled: a stop was requested. Deterministic. `edges` may keep what all_edges() gives from one grid to the next.
Result<GridPreview> sketch_grid(const Artwork& artwork, const PlanOptions& options, GridEffort effort,
                                const std::stop_token& stop = {}, const EdgeFinder& edges = all_edges);

}  // namespace veneer::planner
