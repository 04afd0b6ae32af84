// The edges that a grid's lines follow, kept on the disk from grid to grid: while a hand pins vertices or paints which
// edges count, they stay the same, and finding them takes longer than all the rest.
//
// What is kept is used only for the very pixels, spacing and filters that it was made of; anything else is found anew.
// At most kKeptEdges files of a byte for each pixel, half of them for coarse grids, which may be deleted at any time;
// what a process left that was killed while it wrote goes after an hour, when edges are found next. For what is shown
// while somebody draws, and for no plan: a worker that reads a foreign picture writes them. Blocks on files. Several
// processes may share the folder.
#pragma once

#include <cstddef>
#include <string>

#include "planner/morph/edge_image.h"
#include "planner/suggest/grid_sketch.h"

namespace veneer::daemon {

inline constexpr std::size_t kKeptEdges = 16;

// For grids of this effort; where nothing can be kept, `from` finds them each time.
// REQUIRES: a folder of its own: indexes of panels (planner/matching/index_cache.h) that lie there are deleted.
planner::EdgeFinder kept_edges(const std::string& folder, planner::GridEffort effort,
                               const planner::EdgeFinder& from = planner::all_edges);

}  // namespace veneer::daemon
