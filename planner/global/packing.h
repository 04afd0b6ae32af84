// Room for as many equal rectangles as free wood can hold: where a plan starts from when greedy has run out of wood,
// because pieces that choose one after the other leave gaps in which no further piece fits.
//
// Shelves: at each rotation, wood that rectangles can cover without a break is a region, filled by rows of rectangles
// side by side; which rows is decided by dynamic programming. The regions of all rotations compete, the largest first;
// annealing over single rectangles settles what they take from each other. What is left over is looked at again.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"

namespace veneer::planner {

// Poses of rectangles of `width` x `height` (sides of patches, without kerf), none in another's way by the rules of
// free_wood.h, at the matcher's rotations, on wood as it was before anything was taken. More than `enough` are found
// where that costs no effort. Deterministic, any number of threads. kCancelled: a stop was requested.
Result<std::vector<Pose>> pack_rectangles(const Matcher& matcher, Millimetres width, Millimetres height,
                                          std::size_t enough, int threads, const std::stop_token& stop);

}  // namespace veneer::planner
