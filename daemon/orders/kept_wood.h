// The wood as sketches look at it: maps and free wood at planner::kSketchDpi, kept on the disk from sketch to sketch,
// because decoding a panel's map takes longer than a sketch may.
//
// In the folder of the planner's indexes, and gone with them (planner/matching/index_cache.h). What is kept is used
// only for the very map, mask, live allocations and margin that it was made of; anything else is made anew and replaces
// it. Blocks on files. Several processes may share the folder.
#pragma once

#include <string>

#include "daemon/orders/job_wood.h"

namespace veneer::daemon {

// Free wood is never too generous: a pixel is free where all that lies in it is. kStorage: a panel's pictures cannot be
// read, or the folder cannot be written to. What cannot be kept is made again the next time.
WoodPictures kept_wood(const std::string& index_dir, const WoodPictures& from = stored_wood());

}  // namespace veneer::daemon
