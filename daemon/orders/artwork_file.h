// The picture of an order, as the planner takes it. Blocks on the disk; thread-safe.
#pragma once

#include <string>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::daemon {

struct ArtworkFiles {
  std::string picture;
  std::string segmentation{};  // laid over the whole picture: areas_of_file() of it; "": there is none
};

// The part `crop` (planner::crop_of(); "": all) of the picture, with `size` as its shorter side.
// kInvalidArgument: it is no picture, the crop does not lie within it, or the segmentation has no areas.
Result<planner::Artwork> read_artwork(const ArtworkFiles& files, const std::string& name, const std::string& crop,
                                      Millimetres size);

}  // namespace veneer::daemon
