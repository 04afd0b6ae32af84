// The picture of an order, as the planner takes it. Blocks on the disk; thread-safe.
#pragma once

#include <string>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::daemon {

// The part `crop` (planner::crop_of(); "": all) of the picture in `file`, with `size` as its shorter side.
// kInvalidArgument: it is no picture, or the crop does not lie within it.
Result<planner::Artwork> read_artwork(const std::string& file, const std::string& name, const std::string& crop,
                                      Millimetres size);

}  // namespace veneer::daemon
